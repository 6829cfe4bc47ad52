// Residual power of patches, |Σ r·A| [stored units · solver area], summed over RGB. Less light than was shot is a negative residual,
// and is shot like any other [Chen90].
// One texel per block of 4×4: of a block that is a patch, or part of one, Σ r·A; of one that holds smaller patches the strongest.
#include "common/tile.glsl"
#include "shooting/patch_level.glsl"

uniform sampler2D t_position_area;
uniform sampler2D t_residual;

layout(location = 0) out vec4 out_patch;  // Σ r·A and -1 - level; or power, corner of the patch [texels], Σ of the powers

vec3 flux_of(ivec2 px) { return texelFetch(t_residual, px, 0).rgb * texelFetch(t_position_area, px, 0).w; }

void main() {
    ivec2 block_px = ivec2(gl_FragCoord.xy) * BLOCK;
    int level = patch_level(block_px), size = 1 << max(level, 0);
    out_patch = vec4(0.0);
    if (level < 0) return;
    if (size >= BLOCK) {
        for (int k = 0; k < BLOCK * BLOCK; ++k) out_patch.rgb += flux_of(block_px + ivec2(k % BLOCK, k / BLOCK));
        out_patch.a = -1.0 - float(level);
        return;
    }
    for (int j = 0; j < BLOCK; j += size)
        for (int i = 0; i < BLOCK; i += size) {
            ivec2 corner_px = block_px + ivec2(i, j);
            vec3 flux = vec3(0.0);
            for (int k = 0; k < size * size; ++k) flux += flux_of(corner_px + ivec2(k % size, k / size));
            float power = dot(abs(flux), vec3(1.0));
            out_patch.w += power;
            if (power > out_patch.x) out_patch.xyz = vec3(power, corner_px);
        }
}
