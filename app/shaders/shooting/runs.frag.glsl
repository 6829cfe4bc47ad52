// The strongest patch of each run of slots, and the run's power: (power, corner x, y [texels], Σ power). One texel per run.
#define TILE_BLOCKS 4

#include "shooting/block.glsl"

uniform sampler2D t_patches;
uniform int u_runs;
uniform int u_slots;  // up to the last that is used

layout(location = 0) out vec4 out_run;

// (power, corner, Σ) of the patches that begin in a block
vec4 begins_in(ivec2 block) {
    vec4 one = texelFetch(t_patches, block, 0);
    if (one.a >= 0.0) return one;
    int edge = 1 << max(int(-1.0 - one.a) - 2, 0);  // of the patch [blocks]
    if (any(notEqual(block & (edge - 1), ivec2(0)))) return vec4(0.0);
    vec3 flux = one.rgb;
    for (int k = 1; k < edge * edge; ++k) flux += texelFetch(t_patches, block + ivec2(k % edge, k / edge), 0).rgb;
    float power = dot(abs(flux), vec3(1.0));
    return vec4(power, block * BLOCK, power);
}

void main() {
    int run = int(gl_FragCoord.x), columns = textureSize(t_patches, 0).x / TILE_BLOCKS;
    out_run = vec4(0.0);
    for (int slot = run * u_slots / u_runs; slot < (run + 1) * u_slots / u_runs; ++slot) {
        ivec2 corner = ivec2(slot % columns, slot / columns) * TILE_BLOCKS;
        for (int k = 0; k < TILE_BLOCKS * TILE_BLOCKS; ++k) {
            vec4 patch_ = begins_in(corner + ivec2(k % TILE_BLOCKS, k / TILE_BLOCKS));
            out_run.w += patch_.w;
            if (patch_.x > out_run.x) out_run.xyz = patch_.xyz;
        }
    }
}
