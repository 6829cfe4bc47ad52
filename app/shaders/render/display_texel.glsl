// A display texel as a surface shows it: its colour, and what lies over it.
// The shader that includes it has the defines OVERLAY and BICUBIC, t_display, u_texel and v_uv.
#if OVERLAY
#include "render/overlay.glsl"
#endif
#if BICUBIC
#include "render/bicubic.glsl"
#endif

// uv: atlas texels of level 0; place: of the leaf there
vec3 display_at(vec2 uv, vec4 place) {
    vec2 texel = uv * place.z + place.xy;
#if BICUBIC
    return bicubic(t_display, texel, u_texel.xy);
#else
    return textureLod(t_display, texel * u_texel.xy, 0.0).rgb;
#endif
}

// With what lies over it, on the side that is seen; the same where nothing does.
vec3 under_overlay(vec3 colour, vec2 uv, vec4 place) {
#if OVERLAY
    vec4 per_px = max(fwidth(v_uv), 1e-6);
    return overlaid(colour, uv, gl_FrontFacing ? per_px.xy : per_px.zw, place.z, place.w);
#else
    return colour;
#endif
}
