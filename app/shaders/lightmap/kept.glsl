// What stays as it is when leaves split and merge: the exitance that a texel has shot already, S = E + ρH - r. Its new leaves
// keep S, so that r = E + ρH - S. What 8 bits hold cannot be negative, as r then may become: there r itself is kept. In a, the
// power that a texel would have got without occluders, see app/lightmap/textures.py.
#include "common/albedo.glsl"
#include "common/exitance.glsl"

uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform float u_unit;   // W/m² per stored unit
uniform bool u_signed;  // whether r may be negative

// B = E + ρH [stored units]
vec3 radiosity(ivec2 texel_px, vec3 H) {
    uint material = material_from_ids(texelFetch(t_normal_ids, texel_px, 0).y);
    return exitance_of(t_materials, material, texel_px) / u_unit + albedo_of(t_materials, material, texel_px) * H;
}

vec4 kept_from_residual(ivec2 texel_px, vec3 H, vec4 r) {
    return u_signed ? vec4(radiosity(texel_px, H) - r.rgb, r.a) : r;
}

vec4 residual_from_kept(ivec2 texel_px, vec3 H, vec4 kept) {
    return u_signed ? vec4(radiosity(texel_px, H) - kept.rgb, kept.a) : kept;
}
