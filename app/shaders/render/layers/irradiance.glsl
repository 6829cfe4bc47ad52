// Irradiance H + a, with the ambient light that is still to come, as the radiance that a white surface would have of it.
#include "common/atlas.glsl"
#include "common/ambient.glsl"
uniform sampler2D t_light;  // irradiance H
uniform float u_unit;       // W/m² per stored unit

vec3 layer_colour(ivec2 texel_px) {
    vec3 H = texelFetch(t_light, texel_px, 0).rgb;
    return (H + ambient_at(texel_px, H)) * (u_unit / PI);
}

vec3 unlit_colour(int material) { return vec3(0.0); }
