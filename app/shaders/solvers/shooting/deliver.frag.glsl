// The light of a batch is blended into H and r of every texel:
//
//   ΔH_j = Σ_i s_i R_i F_ji V_ji,   Δr_j = ρ_j ΔH_j      [Coombe03, eq. 1; s_i from gain.frag.glsl]
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "solvers/shooting/shooter_block.glsl"
#define SHADOWS 0  // whether leaves may ask how much of its light a texel sees

uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_first;
uniform sampler2D t_last;
#if SHADOWS
uniform sampler2D t_unoccluded;
#endif

// a: Σ_i P_i F_ji V_ji and Σ_i P_i F_ji, with P the sum of |R| over RGB: how much of its light a texel sees
layout(location = 0) out vec4 out_irradiance;
layout(location = 1) out vec4 out_residual;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    vec4 first = texelFetch(t_first, px, 0), last = texelFetch(t_last, px, 0);
    float FV[BATCH] = float[](first.x, first.y, first.z, first.w, last.x, last.y, last.z, last.w);
    vec3 light = vec3(0.0);
    vec2 share = vec2(0.0);
    for (int shot = 0; shot < BATCH; ++shot) {
        Shooter s = shooter_of(shot);
        light += s.gain * s.exitance * FV[shot];
        share.x += dot(abs(s.exitance), vec3(1.0)) * FV[shot];
    }
#if SHADOWS
    share.y = texelFetch(t_unoccluded, px, 0).r;
#endif
    if (share == vec2(0.0)) discard;
    uint material = material_from_ids(texelFetch(t_normal_ids, px, 0).y);
    out_irradiance = vec4(light, share.x);
    out_residual = vec4(albedo_of(t_materials, material, px) * light, share.y);
}
