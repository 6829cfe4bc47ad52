// Texels along the edge of a block, which patches.frag.glsl sums once for patches of every size.
#define BLOCK 4
#define BLOCK_LEVEL 2
