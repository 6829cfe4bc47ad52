// Radiance of the radiosity B = E + ρ(H + a), with the ambient light a that is still to come.
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "common/ambient.glsl"
#include "common/exitance.glsl"
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_light;  // irradiance H
uniform float u_unit;       // W/m² per stored unit

vec3 layer_colour(ivec2 texel_px) {
    uint material = material_from_ids(texelFetch(t_normal_ids, texel_px, 0).y);
    vec3 H = texelFetch(t_light, texel_px, 0).rgb, received = (H + ambient_at(texel_px, H)) * u_unit;
    return (exitance_of(t_materials, material, texel_px) + albedo_of(t_materials, material, texel_px) * received) / PI;
}

vec3 unlit_colour(int material) { return texelFetch(t_materials, ivec2(1, material), 0).rgb / PI; }
