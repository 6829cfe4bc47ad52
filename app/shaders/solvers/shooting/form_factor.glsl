// Form factor F from a point (position, normal) to the shooter's polygon, without visibility.
#define DISC 0
#define DISC_SUBDIVISION 1
#define NEAR_FIELD 0
#include "common/contour.glsl"
#include "solvers/shooting/far_field.glsl"

const float GAUSS = 0.28867513459481287;  // 1 / (2 √3): two-point rule on [-1/2, 1/2]

float polygon_form_factor(vec3 centre, vec3 normal, Shooter s) {
    vec3 hu = 0.5 * s.edge_u, hv = 0.5 * s.edge_v;
    return contour(centre - hu - hv, centre - hu + hv, centre + hu + hv, centre + hu - hv, normal) / TWO_PI;
}

// cosθ_j cosθ_i / (π r²) at 2×2 Gauss points, or in the middle; height: of the receiver above the shooter's plane
float far_form_factor(vec3 centre, vec3 normal, float height, Shooter s) {
    bool one = squared_edge(s) < POINT_RATIO * dot(centre, centre);
    vec3 gu = one ? vec3(0.0) : GAUSS * s.edge_u, gv = one ? vec3(0.0) : GAUSS * s.edge_v;
    int points = one ? 1 : 4, k = 0;
    float sum = 0.0;
    do {
        vec3 d = centre + ((k & 1) == 0 ? gu : -gu) + ((k & 2) == 0 ? gv : -gv);
        float r2 = dot(d, d);
        sum += max(dot(d, normal), 0.0) / (r2 * r2);
    } while (++k < points);
    return sum * height * s.area / (float(points) * PI);
}

// Wallace's discs: the shooter as m = DISC_SUBDIVISION² oriented discs of area A/m. [Coombe03, eq. 2; Wallace89]
float disc_form_factor(vec3 centre, vec3 normal, float height, Shooter s) {
    float area = s.area / float(DISC_SUBDIVISION * DISC_SUBDIVISION);
    float sum = 0.0;
    for (int j = 0; j < DISC_SUBDIVISION; ++j)
        for (int i = 0; i < DISC_SUBDIVISION; ++i) {
            vec2 at = (vec2(i, j) + 0.5) / float(DISC_SUBDIVISION) - 0.5;
            vec3 d = centre + at.x * s.edge_u + at.y * s.edge_v;
            float r2 = dot(d, d);
            sum += max(dot(d, normal), 0.0) * height / (r2 * (PI * r2 + area)) * area;
        }
    return sum;
}

float form_factor(vec3 position, vec3 normal, Shooter s) {
    vec3 centre = s.centre - position;
    float height = -dot(centre, s.normal);
#if DISC
    float F = disc_form_factor(centre, normal, height, s);
#elif NEAR_FIELD
    float F = polygon_form_factor(centre, normal, s);
#else
    float F = far_form_factor(centre, normal, height, s);
#endif
    return height > 0.0 ? max(F, 0.0) : 0.0;
}
