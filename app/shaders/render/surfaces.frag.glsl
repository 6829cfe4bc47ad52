// The display texels on the surfaces. Lean: this runs for every pixel, also on a software rasteriser.
#define OVERLAY 0

uniform sampler2D t_display;  // developed for the screen
uniform sampler2D t_places;   // per page of the atlas: display texel = z · uv + xy
uniform vec3 u_texel;         // size of a display texel; pages per texel of level 0

in vec4 v_uv;
flat in vec3 v_unlit_front;
flat in vec3 v_unlit_back;

layout(location = 0) out vec4 out_colour;

#if OVERLAY
#include "render/overlay.glsl"
#endif

void main() {
    vec2 uv = gl_FrontFacing ? v_uv.xy : v_uv.zw;
    vec3 place = texelFetch(t_places, max(ivec2(uv * u_texel.z), 0), 0).xyz;
    vec3 colour = textureLod(t_display, (uv * place.z + place.xy) * u_texel.xy, 0.0).rgb;
    if (uv.x < 0.0) colour = gl_FrontFacing ? v_unlit_front : v_unlit_back;
#if OVERLAY
    vec4 per_px = max(fwidth(v_uv), 1e-6);
    if (uv.x >= 0.0) colour = overlaid(colour, uv, gl_FrontFacing ? per_px.xy : per_px.zw, place.z);
#endif
    out_colour = vec4(colour, 1.0);
}
