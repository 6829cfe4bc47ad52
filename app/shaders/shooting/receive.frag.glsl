// One shot's light on every texel, blended into H and r:
//
//   ΔH_j = r_i F_ji V_ji,   Δr_j = ρ_j ΔH_j      [Coombe03, eq. 1; F_ji from the texel to the shooter's polygon]
#define FLAT 1
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "common/item.glsl"
#include <projection>
#include "shooting/shooter_block.glsl"
#include "shooting/form_factor.glsl"
#include "shooting/visible.glsl"

#if FLAT
in vec3 v_position;
flat in vec3 v_normal;
flat in float v_facet;
flat in vec3 v_albedo;
#else
uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
#endif
uniform sampler2D t_map;

layout(location = 0) out vec4 out_irradiance;  // a: F_ji V_ji, for the audit
layout(location = 1) out vec4 out_residual;

void main() {
    ivec2 texel_px = ivec2(gl_FragCoord.xy);
    Shooter s = this_shooter();
#if FLAT
    vec3 position = v_position, normal = v_normal;
    vec3 albedo = v_albedo * albedo_texture(texel_px);
    float facet = v_facet;
#else
    Texel texel = load_texel(t_position_area, t_normal_ids, texel_px);
    // j ∉ i [Coombe03, 3]: a hollow patch would see its own flat polygon from next to it
    ivec2 in_patch = texel_px - s.patch_px;
    bool own = all(greaterThanEqual(in_patch, ivec2(0))) && all(lessThan(in_patch, ivec2(s.size_px)));
    if (texel.area <= 0.0 || own) discard;
    vec3 position = texel.position, normal = texel.normal;
    vec3 albedo = albedo_of(t_materials, texel.material, texel_px);
    float facet = float(texel.facet);
#endif
    mat3 axes = world_axes(s);
    vec3 local = (position - s.origin) * axes;
    if (local.z <= COPLANAR) discard;
    float F = form_factor(position, normal, s);
    float V = visible(facet, local, normal * axes, t_map);
    vec3 irradiance = s.exitance * F * V;
    out_irradiance = vec4(irradiance, F * V);
    out_residual = vec4(albedo * irradiance, 0.0);
}
