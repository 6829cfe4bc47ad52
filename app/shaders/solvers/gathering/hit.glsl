// What a ray hit: a texel of level 0 of the atlas, row << 16 | column. One row further up are what has no texel.
uniform int u_rows;  // of level 0

const int ESCAPED = 0, BLACK = 1, NONE = 2;  // left the scene; met a side without texels, which is black; no ray

uint hit_of(ivec2 atlas_px) { return uint(atlas_px.y) << 16 | uint(atlas_px.x); }
uint no_texel(int what) { return hit_of(ivec2(what, u_rows)); }
ivec2 atlas_px_of(uint hit) { return ivec2(hit & 0xFFFFu, hit >> 16); }
