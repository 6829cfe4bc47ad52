// A gather point stands for a block of texels: that of them which covers something and is nearest to the block's middle.
#include "common/atlas.glsl"
#include "common/facet.glsl"
#include "solvers/shooting/block.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;

#define NEAREST  // texels of a block, row by row, from its middle

const int FROM_MIDDLE[BLOCK * BLOCK] = int[](NEAREST);

// Its texel; of area 0 where the block covers nothing.
Texel gather_point(ivec2 block) {
    ivec2 px = ivec2(0);
    float area = 0.0;
    for (int nth = 0; nth < BLOCK * BLOCK && area <= 0.0; ++nth) {
        px = block * BLOCK + ivec2(FROM_MIDDLE[nth] % BLOCK, FROM_MIDDLE[nth] / BLOCK);
        area = texelFetch(t_position_area, px, 0).w;
    }
    return load_texel(t_position_area, t_normal_ids, px);
}
