// Directions around a normal.
#include "common/atlas.glsl"

// Unit vectors square to a normal. [Duff17]
mat3 frame_of(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0, a = -1.0 / (s + n.z), b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

// Distributed as the cosine: what such rays see is to be averaged, and that is the irradiance over π.
vec3 cosine_direction(vec3 normal, vec2 share) {
    float r = sqrt(share.x), phi = 2.0 * PI * share.y;
    return frame_of(normal) * vec3(r * cos(phi), r * sin(phi), sqrt(max(1.0 - share.x, 0.0)));
}
