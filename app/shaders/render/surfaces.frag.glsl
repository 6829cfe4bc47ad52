// The display texels on the surfaces. Lean: this runs for every pixel, also on a software rasteriser.
#define OVERLAY 0

uniform sampler2D t_display;  // developed for the screen
uniform sampler2D t_places;   // per 16×16 page of the atlas: where its first display texel is
uniform vec2 u_texel;         // size of a display texel

in vec4 v_uv;
flat in vec3 v_unlit_front;
flat in vec3 v_unlit_back;

layout(location = 0) out vec4 out_colour;

#if OVERLAY
#include "render/overlay.glsl"
#endif

void main() {
    vec2 uv = gl_FrontFacing ? v_uv.xy : v_uv.zw;
    vec2 page = floor(uv * 0.0625);
    vec2 at = texelFetch(t_places, max(ivec2(page), 0), 0).xy + uv - page * 16.0;
    vec3 colour = textureLod(t_display, at * u_texel, 0.0).rgb;
    if (uv.x < 0.0) colour = gl_FrontFacing ? v_unlit_front : v_unlit_back;
#if OVERLAY
    vec4 per_px = max(fwidth(v_uv), 1e-6);
    if (uv.x >= 0.0) colour = overlaid(colour, uv, gl_FrontFacing ? per_px.xy : per_px.zw);
#endif
    out_colour = vec4(colour, 1.0);
}
