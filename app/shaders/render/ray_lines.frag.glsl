// A ray in the colour of the light that it brings, with dark seams that set it off from a wall of its colour. Blended: dark ones
// are faint.
#include "common/colour.glsl"
uniform float u_gain;  // exposure
uniform float u_width_px;
uniform float u_seam_px;

flat in vec3 v_light;  // radiance
in float v_side_px;

layout(location = 0) out vec4 out_colour;

#include <curve>
#include "render/shown.glsl"

const vec2 ALPHA = vec2(0.18, 0.9);  // of black and of white
const float SEAM = 0.2;

void main() {
    vec3 colour = shown(v_light * u_gain);
    float away = abs(v_side_px) - 0.5 * u_width_px - 0.5, bright = max(colour.r, max(colour.g, colour.b));
    float line = clamp(-away, 0.0, 1.0) * mix(ALPHA.x, ALPHA.y, bright), seam = clamp(u_seam_px - away, 0.0, 1.0) * SEAM * bright;
    float alpha = line + (1.0 - line) * seam;
    out_colour = vec4(colour * line / max(alpha, 1e-6), alpha);
}
