// The scene's triangles, to be fetched by number: three texels each, see app/visibility/occluders.py.
#include "common/item.glsl"

const int TRIANGLES_A_ROW = 512;

struct Triangle {
    vec3 a, b, c;  // solver space
    vec2 sides;    // item of its front, of its back
};

Triangle load_triangle(sampler2D triangles, int id) {
    ivec2 at = ivec2(id % TRIANGLES_A_ROW * 3, id / TRIANGLES_A_ROW);
    vec4 a = texelFetch(triangles, at, 0), b = texelFetch(triangles, at + ivec2(1, 0), 0);
    return Triangle(a.xyz, b.xyz, texelFetch(triangles, at + ivec2(2, 0), 0).xyz, vec2(a.w, b.w));
}

// as the shooter sees it
Triangle seen_from(Triangle t, vec3 origin, mat3 axes) {
    return Triangle((t.a - origin) * axes, (t.b - origin) * axes, (t.c - origin) * axes, t.sides);
}

// Unit normal and its product with a point of the plane: < 0 where the front faces the shooter.
vec4 plane_of(Triangle t) {
    vec3 n = cross(t.b - t.a, t.c - t.a);
    n /= max(length(n), 1e-30);
    return vec4(n, dot(n, t.a));
}

// Whether no sight can end on it: it is the shooter's own, below its horizon, or edge-on.
bool unseen(Triangle t, vec4 plane, float own) {
    bool below = max(t.a.z, max(t.b.z, t.c.z)) <= COPLANAR;
    return below || abs(plane.w) <= COPLANAR || t.sides.r == own || t.sides.g == own;
}
