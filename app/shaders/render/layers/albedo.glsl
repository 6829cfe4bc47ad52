// Albedo ρ.
#include "common/atlas.glsl"
#include "common/albedo.glsl"
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;

vec3 layer_colour(ivec2 texel_px) {
    return albedo_of(t_materials, material_from_ids(texelFetch(t_normal_ids, texel_px, 0).y), texel_px);
}

vec3 unlit_colour(int material) { return texelFetch(t_materials, ivec2(0, material), 0).rgb; }
