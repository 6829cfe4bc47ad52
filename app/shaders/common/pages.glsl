// From the virtual atlas to the tile pool: the page table holds the slot (from 1, 0 = none) of each cell of TILE×TILE texels of
// the finest level, t_leaves what each slot holds. [Coombe03, 4.2]
#include "common/leaves.glsl"
uniform usampler2D t_pages;
uniform vec2 u_pages;  // columns of the tile pool, cells per texel of level 0

// Column and row in the tile pool of the leaf at a place of the atlas [texels of level 0]; negative where there is none.
// Floats: exact up to 2^22 slots, and far cheaper than integer division.
ivec2 slot_at(vec2 uv) {
    ivec2 cell = ivec2(floor(uv * u_pages.y));
    if (any(lessThan(cell, ivec2(0))) || any(greaterThanEqual(cell, textureSize(t_pages, 0)))) return ivec2(-1);
    float slot = float(texelFetch(t_pages, cell, 0).x) - 1.0;
    float row = floor((slot + 0.5) / u_pages.x);
    return ivec2(slot - row * u_pages.x, row);
}
