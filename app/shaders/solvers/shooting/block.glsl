// Blocks of texels, which patches.frag.glsl sums once for patches of every size.
#define BLOCK_LEVEL  // a block has 2^BLOCK_LEVEL texels along its edge

const int BLOCK = 1 << BLOCK_LEVEL;
