// The points around a point that its window reaches, see reach.frag.glsl.
#include "common/tile.glsl"

uniform usampler2D t_reach;
uniform usampler2D t_tiles_beside;  // see tiles_beside.frag.glsl

void visit(ivec2 px);

// Visit every point that is reached, RADIUS texels either way. Whether there is any: a point itself, where it lies on a surface.
bool walk(ivec2 px) {
    uvec3 reach = texelFetch(t_reach, px, 0).xyz;
    ivec2 slot = px / TILE, inside = px - slot * TILE;
    for (int j = -RADIUS; j <= RADIUS; ++j) {
        int row = j + 4, third = row < 3 ? 0 : row < 6 ? 1 : 2;
        uint bits = (third == 0 ? reach.x : third == 1 ? reach.y : reach.z) >> (9 * (row - 3 * third) + 4 - RADIUS);
        bits &= (1u << (2 * RADIUS + 1)) - 1u;
        for (int i = -RADIUS; bits != 0u; ++i, bits >>= 1) {
            if ((bits & 1u) == 0u) continue;
            ivec2 at = inside + ivec2(i, j), tile = (at + TILE) / TILE;
            visit(ivec2(texelFetch(t_tiles_beside, 3 * slot + tile, 0).xy) * TILE + at + TILE - tile * TILE);
        }
    }
    return reach != uvec3(0u);
}
