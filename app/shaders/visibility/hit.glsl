// What a ray hit: a texel of the points, row << 16 | column. One row further up are what has none.
uniform int u_rows;  // of texels

const int ESCAPED = 0, BLACK = 1, NONE = 2;  // left the scene; met a side without texels, which is black; no ray

uint hit_of(ivec2 texel_px) { return uint(texel_px.y) << 16 | uint(texel_px.x); }
uint no_texel(int what) { return hit_of(ivec2(what, u_rows)); }
ivec2 texel_px_of(uint hit) { return ivec2(hit & 0xFFFFu, hit >> 16); }
