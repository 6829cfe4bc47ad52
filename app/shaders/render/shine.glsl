// A leaf that was split off a moment ago shines, and fades within a second.
#include "render/level_colour.glsl"
uniform float u_now;  // s

vec3 shining(vec3 colour, float level, float born) {
    float fresh = clamp(1.0 - (u_now - born), 0.0, 1.0);
    return mix(colour, mix(level_colour(level), vec3(1.0), 0.35), 0.5 * fresh * fresh);
}
