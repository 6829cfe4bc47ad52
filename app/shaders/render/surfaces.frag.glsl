// The display texels on the surfaces. Lean: this runs for every pixel, also on a software rasteriser.
#define OVERLAY 0
#define BICUBIC 0
#define OPACITY 0  // of those that are not opaque

uniform sampler2D t_display;  // developed for the screen
uniform vec3 u_texel;         // size of a display texel; pages per texel of level 0

#include "render/places.glsl"

in vec4 v_uv;
flat in vec3 v_unlit_front;
flat in vec3 v_unlit_back;
#if OPACITY
#include "visibility/opacity.glsl"
flat in uint v_row;
in vec3 v_position;
#endif

layout(location = 0) out vec4 out_colour;

#include "render/display_texel.glsl"

void main() {
    float alpha = 1.0;
#if OPACITY
    alpha = opacity_at(int(v_row), v_position);
    if (alpha <= 0.0) discard;
#endif
    vec2 uv = gl_FrontFacing ? v_uv.xy : v_uv.zw;
    vec4 place = place_of(max(ivec2(uv * u_texel.z), 0));
    vec3 colour = under_overlay(display_at(uv, place), uv, place);
    if (uv.x < 0.0) colour = gl_FrontFacing ? v_unlit_front : v_unlit_back;
    out_colour = vec4(colour, alpha);
}
