// What sends light: a texel, or what stands for a window of texels. F is its form factor, without visibility, from a point.
#include "common/atlas.glsl"
#include "common/contour.glsl"
#include "common/facet.glsl"
#include "common/item.glsl"
#include "solvers/pairs/rows.glsl"

uniform sampler2D t_place;   // of each sender: position and area, solver space
uniform sampler2D t_facing;  // normal, facet

struct Sender {
    vec3 position;
    float area;
    vec3 normal;
    float facet;
};

Sender load_sender(int number) {
    vec4 place = texelFetch(t_place, row_px(number), 0), facing = texelFetch(t_facing, row_px(number), 0);
    return Sender(place.xyz, place.w, facing.xyz, facing.w);
}

// Where a point is closer than so many areas, squared, a sender is a square; else a point, off by a fraction of A / r².
const float CLOSE = 32.0;

// The sender as a square of its area, along the axes of its texels: closed form, below 1 however close it is. [Lambert1760; Baum89]
float close_form_factor(vec3 way, vec3 normal, Sender s) {
    vec3 u = facet_entry(uint(s.facet), 0).xyz, v = facet_entry(uint(s.facet), 1).xyz;
    float scale = 0.5 * sqrt(s.area / max(length(cross(u, v)), 1e-30));
    u *= scale;
    v *= scale;
    return abs(contour(way - u - v, way - u + v, way + u + v, way + u - v, normal)) / TWO_PI;
}

// cosθ_i cosθ_j A / (π r²) from a point, where both see each other's front.
float form_factor(vec3 position, vec3 normal, Sender s) {
    vec3 way = s.position - position;
    float r2 = dot(way, way), here = dot(way, normal), there = -dot(way, s.normal);
    if (min(here, there) <= COPLANAR) return 0.0;
    if (r2 < CLOSE * s.area) return close_form_factor(way, normal, s);
    return here * there * s.area / (PI * r2 * r2);
}
