// Error of the irradiance H + a against a reference R: |H + a - R| / |R|, where R is dark over the light that counts as dark.
#include "common/ambient.glsl"
uniform sampler2D t_light;      // irradiance H
uniform sampler2D t_reference;  // R [W/m²]
uniform float u_unit;           // W/m² per stored unit
uniform float u_dark;           // length of a colour that counts as dark [W/m²]

vec3 layer_colour(ivec2 texel_px) {
    vec3 H = texelFetch(t_light, texel_px, 0).rgb, received = (H + ambient_at(texel_px, H)) * u_unit, right = texelFetch(t_reference, texel_px, 0).rgb;
    return vec3(length(received - right) / max(length(right), u_dark));
}

vec3 unlit_colour(int material) { return vec3(0.0); }
