// Each cell of 8×8 texels keeps the strongest patch that begins in it: one texel per cell. Patches are as large as they may be,
// see patches.frag.glsl.
#define TILE_CELLS 2
#define HIGHEST 4

#include "solvers/shooting/candidate.glsl"
#include "solvers/shooting/cell.glsl"

uniform sampler2D t_patches;
uniform sampler2D t_unshot;
uniform sampler2D t_lit;

layout(location = 0) out vec4 out_candidate;
layout(location = 1) out vec4 out_unshot;  // of the tile that begins here: Σ r A, and its absolute value summed over RGB

const int CELL = 1 << (CELL_LEVEL - BLOCK_LEVEL);  // blocks along its edge

// Whether a square of blocks is one patch; its flux
bool is_patch(ivec2 corner, int level, out vec3 flux) {
    int edge = 1 << (level - BLOCK_LEVEL), largest = HIGHEST, finest = HIGHEST;
    vec2 lit = UNLIT_YET;
    flux = vec3(0.0);
    for (int k = 0; k < edge * edge; ++k) {
        ivec2 block = corner + ivec2(k % edge, k / edge);
        vec4 one = texelFetch(t_patches, block, 0);
        if (!is_part(one)) return false;
        flux += one.rgb;
        largest = min(largest, largest_of(one));
        finest = min(finest, finest_of(one));
        lit = lit_with(lit, texelFetch(t_lit, block, 0).xy);
    }
    return level <= finest || level <= largest && !partly_covered(lit);
}

vec4 begins_in(ivec2 corner) {
    vec3 flux;
    for (int level = HIGHEST; level >= CELL_LEVEL; --level) {
        ivec2 within = corner & ((1 << (level - BLOCK_LEVEL)) - 1);
        if (!is_patch(corner - within, level, flux)) continue;
        if (within != ivec2(0)) return vec4(0.0);
        float power = power_of(flux);
        return candidate(power, corner * BLOCK, level, power);
    }
    vec4 best = vec4(0.0);
    for (int k = 0; k < CELL * CELL; ++k) {
        ivec2 block = corner + ivec2(k % CELL, k / CELL);
        vec4 one = texelFetch(t_patches, block, 0);
        float power = power_of(one.rgb);
        if (is_part(one)) one = candidate(power, block * BLOCK, BLOCK_LEVEL, power);
        best = vec4(one.x > best.x ? one.xyz : best.xyz, best.w + one.w);
    }
    return best;
}

void main() {
    ivec2 cell = ivec2(gl_FragCoord.xy);
    out_candidate = begins_in(cell * CELL);
    out_unshot = vec4(0.0);
    if (any(notEqual(cell % TILE_CELLS, ivec2(0)))) return;
    const int BLOCKS = TILE_CELLS * CELL;
    for (int k = 0; k < BLOCKS * BLOCKS; ++k)
        out_unshot.rgb += texelFetch(t_unshot, cell * CELL + ivec2(k % BLOCKS, k / BLOCKS), 0).rgb;
    out_unshot.a = power_of(out_unshot.rgb);
}
