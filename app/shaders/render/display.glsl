// Where display texels come from: a texel of the tile pool, or none.
const uint NO_SOURCE = 0xFFFFFFFFu;
