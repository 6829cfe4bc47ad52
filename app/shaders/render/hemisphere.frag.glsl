// What a ray brings, where no other ray is nearer: cones that hide each other.
#include "common/colour.glsl"
uniform float u_gain;  // exposure

flat in vec3 v_light;  // radiance
in vec2 v_offset;
in vec2 v_place;

layout(location = 0) out vec4 out_colour;

#include <curve>

void main() {
    float away = length(v_offset), radius = length(v_place), px = fwidth(radius);
    float inside = clamp((1.0 - radius) / px + 0.5, 0.0, 1.0);
    if (away >= 1.0 || inside <= 0.0) discard;
    gl_FragDepth = away;
    out_colour = vec4(encode_srgb(develop(v_light * u_gain)), inside);
}
