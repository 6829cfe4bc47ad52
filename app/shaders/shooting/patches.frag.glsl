// Residual power of patches, |Σ r·A| [stored units · solver area], summed over RGB. Less light than was shot is a negative residual,
// and is shot like any other [Chen90].
// One texel per block of 4×4, with the strongest patch that begins in it.
#include "common/tile.glsl"
#include "shooting/patch_level.glsl"

uniform sampler2D t_position_area;
uniform sampler2D t_residual;

layout(location = 0) out vec4 out_patch;  // power, corner of the patch [texels], Σ of the powers in the block

float patch_power(ivec2 corner_px, int size) {
    vec3 power = vec3(0.0);
    for (int j = 0; j < size; ++j)
        for (int i = 0; i < size; ++i) {
            ivec2 px = corner_px + ivec2(i, j);
            power += texelFetch(t_residual, px, 0).rgb * texelFetch(t_position_area, px, 0).w;
        }
    return dot(abs(power), vec3(1.0));
}

void main() {
    ivec2 block_px = ivec2(gl_FragCoord.xy) * BLOCK;
    int level = patch_level(block_px), size = 1 << max(level, 0);
    out_patch = vec4(0.0);
    if (level < 0 || any(notEqual(block_px & (size - 1), ivec2(0)))) return;
    for (int j = 0; j < BLOCK; j += size)
        for (int i = 0; i < BLOCK; i += size) {
            ivec2 corner_px = block_px + ivec2(i, j);
            float power = patch_power(corner_px, size);
            out_patch.w += power;
            if (power > out_patch.x) out_patch.xyz = vec3(power, corner_px);
        }
}
