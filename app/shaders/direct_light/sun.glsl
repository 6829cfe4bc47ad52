// The sun: a disc far away, of the same radiance all over.
#include "common/hemisphere.glsl"
uniform vec4 u_sun;  // towards its middle; w: 1 - cosine of half the angle across

// Evenly within the disc.
vec3 sun_direction(vec2 share) {
    float z = 1.0 - share.x * u_sun.w, r = sqrt(max(1.0 - z * z, 0.0)), phi = 2.0 * PI * share.y;
    return frame_of(u_sun.xyz) * vec3(r * cos(phi), r * sin(phi), z);
}
