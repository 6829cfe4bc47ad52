// Where display texels come from: a texel of the node set, or none.
const uint NO_SOURCE = 0xFFFFFFFFu;
