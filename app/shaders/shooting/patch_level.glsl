// Mip levels of the patches that may shoot, the largest and the finest. In a quadtree, patches of all leaves are about as large in
// the scene: a leaf that is split shoots from as many texels more. Strong emitters, and patches whose shot would make or lose light,
// are finer than that.
#define LEVEL 2
#define FINEST 2   // where LEVEL will end
#define HIGHEST 4  // no patch is larger than a tile

#include "common/leaves.glsl"
#include "shooting/block.glsl"

uniform sampler2D t_finer;  // 0, or 1 + how many levels the patches in each block are finer than FINEST

struct Levels { int largest, finest; };

// px: a texel of the node set; -1: its slot holds no leaf
Levels patch_levels(ivec2 px) {
    float texel_size = texelFetch(t_leaves, px / TILE, 0).z;
    if (texel_size <= 0.0) return Levels(-1, -1);
    int leaf = int(round(log2(texel_size))), finer = int(texelFetch(t_finer, px / BLOCK, 0).r);
    int largest = min(LEVEL - leaf, HIGHEST), finest = min(FINEST - leaf, HIGHEST);
    if (finer > 0) largest = finest = finest + 1 - finer;
    return Levels(max(largest, 0), max(finest, 0));
}
