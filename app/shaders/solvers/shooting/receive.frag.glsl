// What every texel sees of some shots, F_ji V_ji [Coombe03, eq. 1; F_ji from the texel to the shooter's polygon]: for each shot of
// a batch by itself, blended, for deliver.frag.glsl; or the light of earlier shots at once:
//
//   ΔH_j = Σ_i R_i F_ji V_ji
#define PLANAR 1
#define AT_ONCE 0
#define SHADOWS 0  // whether leaves may ask how much of its light a texel sees
#include "common/atlas.glsl"
#include "common/item.glsl"
#include <projection>
#include "solvers/shooting/shooter_block.glsl"
#include "solvers/shooting/form_factor.glsl"
#include "visibility/visible.glsl"

flat in uint v_shots;  // a bit for each shot that may light this receiver
#if PLANAR
in vec3 v_position;
flat in vec3 v_normal;
flat in float v_facet;
#else
#include "solvers/shooting/belongs.glsl"
uniform int u_own;  // whether patches are still where they shot from
uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
#endif

#if AT_ONCE
layout(location = 0) out vec4 out_irradiance;
#else
layout(location = 0) out vec4 out_first;  // F V of the first four shots of the batch
layout(location = 1) out vec4 out_last;   // of the others
#if SHADOWS
layout(location = 2) out float out_unoccluded;  // Σ_i P_i F_ji, with P the sum of |R| over RGB
#endif
#endif

// F_ji, V_ji
vec2 received(vec3 position, vec3 normal, float facet, Shooter s, int shot) {
    mat3 axes = world_axes(s);
    vec3 local = (position - s.origin) * axes;
    vec2 FV = vec2(form_factor(position, normal, s), visible(facet, local, normal * axes, shot));
    return local.z > COPLANAR ? FV : vec2(0.0);
}

void main() {
    ivec2 texel_px = ivec2(gl_FragCoord.xy);
#if PLANAR
    vec3 position = v_position, normal = v_normal;
    float facet = v_facet;
#else
    Texel texel = load_texel(t_position_area, t_normal_ids, texel_px);
    vec3 position = texel.position, normal = texel.normal;
    float facet = float(texel.facet), chart = chart_of(texel.facet);
#endif
#if AT_ONCE
    out_irradiance = vec4(0.0);
#else
    out_first = out_last = vec4(0.0);
#if SHADOWS
    out_unoccluded = 0.0;
#endif
#endif
    uint shots = v_shots;
    do {
        int shot = findLSB(shots);
        shots &= shots - 1u;
        Shooter s = shooter_of(shot);
        vec2 FV = received(position, normal, facet, s, shot);
#if !PLANAR
        // j ∉ i [Coombe03, 3]: a hollow patch would see its own flat polygon from next to it. Another chart in it is no part of
        // it.
        bool within = u_own != 0 && all(lessThan(uvec2(texel_px - patch_px(s)), uvec2(size_px(s))));
        FV = within && chart == s.chart || texel.area <= 0.0 ? vec2(0.0) : FV;
#endif
#if AT_ONCE
        out_irradiance.rgb += s.exitance * FV.x * FV.y;
#else
        ivec4 place = ivec4(0, 1, 2, 3) - (u_first + shot);
        out_first += FV.x * FV.y * vec4(equal(place, ivec4(0)));
        out_last += FV.x * FV.y * vec4(equal(place, ivec4(-4)));
#if SHADOWS
        out_unoccluded += dot(abs(s.exitance), vec3(1.0)) * FV.x;
#endif
#endif
    } while (shots != 0u);
}
