// Whether texel i and sender j see each other: a ray between them, always from the lower number to the higher, so that it says the
// same both ways.
#include "visibility/rays.glsl"

bool seen(int i, vec3 p, vec3 n, int j, vec3 q, vec3 m) {
    vec3 from = p + 2.0 * COPLANAR * n, to = q + 2.0 * COPLANAR * m;
    vec3 way = i < j ? to - from : from - to;
    float r = length(way);
    return !any_hit(i < j ? from : to, way / r, 0.0, r);
}
