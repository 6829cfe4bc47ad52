// Radiosity of a texel that holds so much irradiance, B = E + ρH [stored units].
#include "common/albedo.glsl"
#include "common/exitance.glsl"

uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform float u_unit;  // W/m² per stored unit

vec3 radiosity(ivec2 texel_px, vec3 H) {
    uint material = material_from_ids(texelFetch(t_normal_ids, texel_px, 0).y);
    return exitance_of(t_materials, material, texel_px) / u_unit + albedo_of(t_materials, material, texel_px) * H;
}
