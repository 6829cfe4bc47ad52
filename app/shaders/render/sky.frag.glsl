// The sky behind the surfaces, and the sun's disc, developed for the screen as they are.
#include "common/colour.glsl"
#include "common/sky.glsl"
uniform float u_gain;  // exposure
uniform ivec2 u_size;  // of the picture [px]
uniform mat3 u_world_from_ndc;
uniform vec3 u_scale;  // of the map [W/(sr m²)]
uniform vec4 u_sun;    // towards it; w: least cosine of what lies within its disc
uniform vec3 u_sun_radiance;

layout(location = 0) out vec4 out_colour;

// develop(rgb): linear Rec.709 of the screen, 0 to 1
#include <curve>
#include "render/shown.glsl"

void main() {
    vec2 ndc = 2.0 * gl_FragCoord.xy / vec2(u_size) - 1.0;
    vec3 direction = normalize(u_world_from_ndc * vec3(ndc, 1.0));
    vec3 radiance = u_scale * textureLod(t_sky, sky_uv(direction), 0.0).rgb;
    if (dot(direction, u_sun.xyz) >= u_sun.w) radiance += u_sun_radiance;
    out_colour = vec4(shown(radiance * u_gain), 1.0);
}
