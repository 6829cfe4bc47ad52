// Display texels: the node set with a border of one texel around each tile, so that the sampler can interpolate.
#define BORDERED 18
const uint NO_SOURCE = 0xFFFFFFFFu;
