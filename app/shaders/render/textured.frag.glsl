// Materials with textures, over what display texels show of them: the light of texels, and albedo and emission of each pixel.
#include "common/colour.glsl"
#define OVERLAY 0
#define BICUBIC 0
#define LIT 0  // or the albedo alone

uniform sampler2D t_display;  // irradiance as the radiance that a white surface would have of it, exposed
uniform vec3 u_texel;         // size of a display texel; pages per texel of level 0
uniform sampler2D t_albedo_picture;
uniform sampler2D t_emission_picture;
uniform vec3 u_albedo;
uniform vec3 u_emission;  // radiance, exposed

#include "render/places.glsl"

in vec4 v_uv;
in vec2 v_albedo_uv;
in vec2 v_emission_uv;
in vec3 v_colour;

layout(location = 0) out vec4 out_colour;

// develop(rgb): linear Rec.709 of the screen, 0 to 1
#include <curve>
#include "render/shown.glsl"
#if OVERLAY
#include "render/overlay.glsl"
#endif
#if BICUBIC
#include "render/bicubic.glsl"
#endif

void main() {
    vec2 uv = gl_FrontFacing ? v_uv.xy : v_uv.zw;
    vec4 place = place_of(max(ivec2(uv * u_texel.z), 0));
    vec3 albedo = u_albedo * v_colour * texture(t_albedo_picture, v_albedo_uv).rgb;
#if LIT
    vec2 texel = uv * place.z + place.xy;
#if BICUBIC
    vec3 light = bicubic(t_display, texel, u_texel.xy);
#else
    vec3 light = textureLod(t_display, texel * u_texel.xy, 0.0).rgb;
#endif
    vec3 colour = shown(albedo * max(light, 0.0) + u_emission * texture(t_emission_picture, v_emission_uv).rgb);
#else
    vec3 colour = shown(albedo);
#endif
#if OVERLAY
    vec4 per_px = max(fwidth(v_uv), 1e-6);
    colour = overlaid(colour, uv, gl_FrontFacing ? per_px.xy : per_px.zw, place.z, place.w);
#endif
    if (uv.x < 0.0) discard;  // a side without texels
    out_colour = vec4(colour, 1.0);
}
