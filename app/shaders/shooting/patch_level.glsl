// Mip level of the patches that shoot. In a quadtree, patches of all leaves are about as large in the scene: a leaf that is split
// shoots from as many texels more. Where a shot would make or lose light, patches are finer.
#define LEVEL 2
#define HIGHEST 4  // no patch is larger than a tile

#include "common/leaves.glsl"
#include "shooting/block.glsl"

uniform sampler2D t_finer;  // levels that patches in each block are finer than elsewhere

// px: a texel of the node set; -1: its slot holds no leaf
int patch_level(ivec2 px) {
    float texel_size = texelFetch(t_leaves, px / TILE, 0).z;
    int level = min(LEVEL - int(round(log2(texel_size))), HIGHEST) - int(texelFetch(t_finer, px / BLOCK, 0).r);
    return texel_size > 0.0 ? max(level, 0) : -1;
}
