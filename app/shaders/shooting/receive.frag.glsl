// One shot's light on every texel, blended into H and r:
//
//   ΔH_j = r_i F_ji V_ji,   Δr_j = ρ_j ΔH_j      [Coombe03, eq. 1; F_ji from the texel to the shooter's polygon]
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "common/item.glsl"
#include <projection>
#include "shooting/shooter.glsl"
#include "shooting/form_factor.glsl"
#include "shooting/visible.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_map;

flat in Shooter v_shooter;

layout(location = 0) out vec4 out_irradiance;  // a: F_ji V_ji, for the audit
layout(location = 1) out vec4 out_residual;

void main() {
    ivec2 texel_px = ivec2(gl_FragCoord.xy);
    Texel texel = load_texel(t_position_area, t_normal_ids, texel_px);
    mat3 axes = world_axes(v_shooter);
    vec3 local = (texel.position - v_shooter.origin) * axes;
    if (texel.area <= 0.0 || local.z <= COPLANAR) discard;
    float F = form_factor(texel.position, texel.normal, v_shooter);
    if (F <= 0.0) discard;
    float V = visible(float(texel.facet), local, texel.normal * axes, t_map);
    vec3 irradiance = v_shooter.exitance * F * V;
    out_irradiance = vec4(irradiance, F * V);
    out_residual = vec4(albedo_of(t_materials, texel.material, texel_px) * irradiance, 0.0);
}
