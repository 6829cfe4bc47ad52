// Mip levels of the patches that may shoot at a place, the largest and the finest. In a quadtree, patches of all leaves are about
// as large in the scene: a leaf that is split shoots from as many texels more. Strong emitters, and patches whose shot would make
// or lose light, are divided into finer ones, see app/solvers/shooting/patch_marks.py. While large patches shoot, one patch of an
// emitter represents all of its group; later all of a group shoot at once, each for itself, and settle what that was off by.
#define LEVEL 2
#define FINEST 2   // where LEVEL will end
#define HIGHEST 4  // no patch is larger than a tile
#define EMITTER    // added to t_finer where patches make groups of an emitter
#define SETTLES 0  // whether only groups of emitters shoot, each patch for itself

#include "common/leaves.glsl"
#include "solvers/shooting/block.glsl"

uniform sampler2D t_finer;  // 0, or 1 + how many levels the patches in each block are finer than FINEST

struct Levels { int largest, finest, shoots; };  // shoots: of the patch that represents such a one

// px: a texel of the tile pool; -1: nothing shoots there
Levels patch_levels(ivec2 px) {
    float texel_size = texelFetch(t_leaves, px / TILE, 0).z;
    if (texel_size <= 0.0) return Levels(-1, -1, -1);
    int leaf = int(round(log2(texel_size))), mark = int(texelFetch(t_finer, px / BLOCK, 0).r), finer = mark % EMITTER;
    int largest = max(min(LEVEL - leaf, HIGHEST), 0), finest = max(min(FINEST - leaf, HIGHEST), 0);
    if (SETTLES == 1 && mark < EMITTER) return Levels(-1, -1, -1);
    if (finer == 0) return Levels(largest, finest, HIGHEST);
    int divided = max(min(FINEST - leaf, HIGHEST) + 1 - finer, 0);
    int group = LEVEL > FINEST && mark >= EMITTER ? min(divided + 1, max(largest, divided)) : divided;
    return Levels(group, group, divided);
}
