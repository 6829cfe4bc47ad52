// Indirect light, H without the direct light, as the radiance that a white surface would have of it.
#include "common/atlas.glsl"
uniform sampler2D t_light;    // irradiance H
uniform sampler2D t_offered;  // direct light
uniform float u_unit;         // W/m² per stored unit

vec3 layer_colour(ivec2 texel_px) {
    return max(texelFetch(t_light, texel_px, 0).rgb - texelFetch(t_offered, texel_px, 0).rgb, 0.0) * (u_unit / PI);
}

vec3 unlit_colour(int material) { return vec3(0.0); }
