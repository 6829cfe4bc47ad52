// Display texels: the node set with a border of one texel around each tile, so that the sampler can interpolate.
#include "common/tile.glsl"
const int BORDERED = TILE + 2;
const uint NO_SOURCE = 0xFFFFFFFFu;
