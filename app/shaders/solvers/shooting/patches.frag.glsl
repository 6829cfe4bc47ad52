// What blocks of 4×4 texels hold, one texel for each: what is to be shot and what is unshot [stored units · solver area], and how
// lit they are. Of groups that settle, the sum of what each texel is off by, whatever its sign.
//
// A patch that is partly covered is divided into the finest: the light of its middle would pass through what stands on it, or
// none would leave it.
#include "common/atlas.glsl"
#include "common/tile.glsl"
#include "common/albedo.glsl"
#include "solvers/shooting/patch_level.glsl"
#include "solvers/shooting/candidate.glsl"
#include "solvers/shooting/overshoot.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_irradiance;
uniform sampler2D t_residual;

layout(location = 0) out vec4 out_patch;   // see candidate.glsl
layout(location = 1) out vec4 out_unshot;  // Σ r A
layout(location = 2) out vec2 out_lit;     // least and greatest H of the texels, summed over RGB

vec3 counted(vec3 flux) { return SETTLES == 1 ? abs(flux) : flux; }

// To be shot from the square with this lower corner
vec3 flux_of(ivec2 corner_px, int edge) {
    vec3 flux = vec3(0.0);
    for (int k = 0; k < edge * edge; ++k) {
        ivec2 px = corner_px + ivec2(k % edge, k / edge);
        float area = texelFetch(t_position_area, px, 0).w;
        if (area <= 0.0) continue;
        vec3 albedo = albedo_of(t_materials, material_from_ids(texelFetch(t_normal_ids, px, 0).y), px);
        vec3 r = texelFetch(t_residual, px, 0).rgb;
        flux += counted((r + overshoot(texelFetch(t_irradiance, px, 0).rgb, albedo)) * area);
    }
    return flux;
}

// The strongest of the block's patches of a level, and the power of all
vec4 strongest_of(ivec2 block_px, int level) {
    vec4 best = vec4(0.0);
    int edge = 1 << level, across = BLOCK >> level;
    for (int nth = 0; nth < across * across; ++nth) {
        ivec2 corner_px = block_px + ivec2(nth % across, nth / across) * edge;
        float power = power_of(flux_of(corner_px, edge)), all = best.w + power;
        best = power > best.x ? candidate(power, corner_px, level, all) : vec4(best.xyz, all);
    }
    return best;
}

void main() {
    ivec2 block_px = ivec2(gl_FragCoord.xy) * BLOCK;
    Levels levels = patch_levels(block_px);
    out_patch = out_unshot = vec4(0.0);
    out_lit = UNLIT_YET;
    if (texelFetch(t_leaves, block_px / TILE, 0).z <= 0.0) return;
    for (int k = 0; k < BLOCK * BLOCK; ++k) {
        ivec2 px = block_px + ivec2(k % BLOCK, k / BLOCK);
        float area = texelFetch(t_position_area, px, 0).w;
        vec3 r = texelFetch(t_residual, px, 0).rgb, H = texelFetch(t_irradiance, px, 0).rgb;
        vec3 albedo = albedo_of(t_materials, material_from_ids(texelFetch(t_normal_ids, px, 0).y), px);
        out_unshot.rgb += r * area;
        out_patch.rgb += counted((r + overshoot(H, albedo)) * area);
        if (area > 0.0) out_lit = lit_with(out_lit, H);
    }
    if (levels.largest < 0) {
        out_patch = vec4(0.0);
        return;
    }
    int level = partly_covered(out_lit) ? levels.finest : levels.largest;
    out_patch = level < BLOCK_LEVEL ? strongest_of(block_px, level) : part(out_patch.rgb, levels.largest, levels.finest);
}
