// Mip level of the patches that a leaf shoots from. In a quadtree, patches of all leaves are about as large in the scene: a leaf that
// is split shoots from as many texels more.
#define LEVEL 2
#define ADAPTIVE 0
#define HIGHEST 4  // no patch is larger than a tile

#if ADAPTIVE
#include "common/leaves.glsl"

// slot: of the leaf in the node set; -1: holds none
int patch_level(ivec2 slot) {
    float texel_size = texelFetch(t_leaves, slot, 0).z;
    return texel_size > 0.0 ? clamp(LEVEL - int(round(log2(texel_size))), 0, HIGHEST) : -1;
}
#else
int patch_level(ivec2 slot) { return LEVEL; }
#endif
