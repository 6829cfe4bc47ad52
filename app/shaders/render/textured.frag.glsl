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
#include "render/display_texel.glsl"

void main() {
    vec2 uv = gl_FrontFacing ? v_uv.xy : v_uv.zw;
    vec4 place = place_of(max(ivec2(uv * u_texel.z), 0));
    vec3 albedo = u_albedo * v_colour * texture(t_albedo_picture, v_albedo_uv).rgb;
#if LIT
    vec3 colour = shown(albedo * max(display_at(uv, place), 0.0) + u_emission * texture(t_emission_picture, v_emission_uv).rgb);
#else
    vec3 colour = shown(albedo);
#endif
    colour = under_overlay(colour, uv, place);
    if (uv.x < 0.0) discard;  // a side without texels
    out_colour = vec4(colour, 1.0);
}
