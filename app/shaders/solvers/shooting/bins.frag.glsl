// A reduction bin holds the strongest candidate of its cells, and the sum of what these hold. One texel per bin.
//
// The cells of a tile fall into as many bins, each tile's beginning elsewhere, so that a lamp in one tile fills half a batch.
#define TILE_CELLS 2

uniform sampler2D t_candidates;
uniform sampler2D t_unshot;
uniform int u_bins;   // a multiple of the cells of a tile
uniform int u_slots;  // up to the last that is used

layout(location = 0) out vec4 out_strongest;  // the strongest candidate; a: power of all
layout(location = 1) out vec4 out_unshot;     // Σ r A, and Σ of its absolute values over tiles

void main() {
    const int CELLS = TILE_CELLS * TILE_CELLS;
    int bin = int(gl_FragCoord.x), columns = textureSize(t_candidates, 0).x / TILE_CELLS, stride = u_bins / CELLS;
    out_strongest = out_unshot = vec4(0.0);
    for (int slot = bin / CELLS, turn = bin; slot < u_slots; slot += stride, ++turn) {
        ivec2 tile = ivec2(slot % columns, slot / columns) * TILE_CELLS;
        ivec2 cell = tile + ivec2(turn % TILE_CELLS, turn / TILE_CELLS % TILE_CELLS);
        vec4 one = texelFetch(t_candidates, cell, 0);
        out_unshot += texelFetch(t_unshot, cell, 0);
        out_strongest = vec4(one.x > out_strongest.x ? one.xyz : out_strongest.xyz, out_strongest.w + one.w);
    }
}
