// The light of some shots is blended into H and r of every texel:
//
//   ΔH_j = Σ_i R_i F_ji V_ji,   Δr_j = ρ_j ΔH_j      [Coombe03, eq. 1; F_ji from the texel to the shooter's polygon]
#define PLANAR 1
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "common/item.glsl"
#include <projection>
#include "solvers/shooting/shooter_block.glsl"
#include "visibility/visible.glsl"
#if LIGHT
#include "common/light.glsl"
#include "visibility/texel_square.glsl"
#else
#include "solvers/shooting/form_factor.glsl"
#endif

flat in uint v_shots;  // a bit for each shot that may light this receiver
#if PLANAR
in vec3 v_position;
flat in vec3 v_normal;
flat in float v_facet;
flat in vec3 v_albedo;
#if LIGHT
flat in vec3 v_u;  // edges of a texel
flat in vec3 v_v;
#endif
#else
#if !LIGHT
#include "solvers/shooting/belongs.glsl"
uniform int u_own;  // whether patches are still where they shot from
#endif
uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
#endif

// a: Σ_i P_i F_ji V_ji and Σ_i P_i F_ji, with P the sum of |r| over RGB: how much of its light a texel sees
layout(location = 0) out vec4 out_irradiance;
layout(location = 1) out vec4 out_residual;

#if LIGHT
// What takes the place of F_ji, and V_ji, the mean over a texel whose edges are u and v
vec2 received(vec3 centre, vec3 normal, float facet, vec3 u, vec3 v, Shooter s, int shot) {
    mat3 axes = world_axes(s);
    bool square = u != v;
    int places = square ? places_of(s.patch_y) : 1;
    vec3 way = centre - s.origin;
    vec2 reach = square ? within_texel(u, v, normalize(way), 2.0 * length(way) / float(RESOLUTION)) : vec2(0.0);
    float seen = 0.0, before = 0.0;  // before: how many lie on the side to which this is shot
    for (int nth = 0; nth < places; ++nth) {
        vec2 at = reach * place_of(s.patch_y, nth);
        vec3 position = centre + at.x * u + at.y * v, local = (position - s.origin) * axes;
        float here = float(local.z > 0.0);
        before += here;
        seen += here * visible(facet, position, local, normal * axes, axes, shot);
    }
    float light = unoccluded(load_light(s.patch_x), centre, normal).r;
    return vec2(light * before / float(places), seen / max(before, 1.0));
}
#else
// F_ji, V_ji
vec2 received(vec3 position, vec3 normal, float facet, Shooter s, int shot) {
    mat3 axes = world_axes(s);
    vec3 local = (position - s.origin) * axes;
    float F = form_factor(position, normal, s), V = visible(facet, position, local, normal * axes, axes, shot);
    return local.z > COPLANAR ? vec2(F, V) : vec2(0.0);
}
#endif

void main() {
    ivec2 texel_px = ivec2(gl_FragCoord.xy);
#if PLANAR
    vec3 position = v_position, normal = v_normal;
    vec3 albedo = v_albedo * albedo_texture(texel_px);
    float facet = v_facet;
#else
    Texel texel = load_texel(t_position_area, t_normal_ids, texel_px);
    vec3 position = texel.position, normal = texel.normal;
    vec3 albedo = albedo_of(t_materials, texel.material, texel_px);
    float facet = float(texel.facet);
#endif
#if LIGHT && PLANAR
    vec3 u = v_u, v = v_v;
#elif LIGHT
    vec3 u, v;
    if (!fills_square(t_normal_ids, texel_px, texel, u, v)) u = v = vec3(0.0);
#endif
    vec3 light = vec3(0.0);
    vec2 share = vec2(0.0);
    uint shots = v_shots;
    do {
        int shot = findLSB(shots);
        shots &= shots - 1u;
        Shooter s = shooter_of(shot);
#if LIGHT
        vec2 FV = received(position, normal, facet, u, v, s, shot);
#else
        vec2 FV = received(position, normal, facet, s, shot);
#endif
#if !PLANAR && !LIGHT
        // j ∉ i [Coombe03, 3]: a hollow patch would see its own flat polygon from next to it. Another chart in it is no part of
        // it.
        bool within = u_own != 0 && all(lessThan(uvec2(texel_px - patch_px(s)), uvec2(size_px(s))));
        FV = within && chart_of(texel.facet) == s.chart ? vec2(0.0) : FV;
#endif
#if !PLANAR
        FV = texel.area <= 0.0 ? vec2(0.0) : FV;
#endif
        light += s.exitance * FV.x * FV.y;
        share += dot(abs(s.exitance), vec3(1.0)) * FV.x * vec2(FV.y, 1.0);
    } while (shots != 0u);
    out_irradiance = vec4(light, share.x);
    out_residual = vec4(albedo * light, share.y);
}
