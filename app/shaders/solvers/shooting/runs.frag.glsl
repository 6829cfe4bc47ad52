// The strongest candidate of each run of squares, and what all of the run hold. One texel per run.
//
// The squares of a tile are dealt to as many runs, each tile's beginning elsewhere, so that a lamp in one tile fills half a batch.
#define TILE_SQUARES 2

uniform sampler2D t_candidates;
uniform sampler2D t_unshot;
uniform int u_runs;   // a multiple of the squares of a tile
uniform int u_slots;  // up to the last that is used

layout(location = 0) out vec4 out_run;     // the strongest candidate; a: power of all
layout(location = 1) out vec4 out_unshot;  // Σ r A, and Σ of its absolute values over tiles

void main() {
    const int SQUARES = TILE_SQUARES * TILE_SQUARES;
    int run = int(gl_FragCoord.x), columns = textureSize(t_candidates, 0).x / TILE_SQUARES, stride = u_runs / SQUARES;
    out_run = out_unshot = vec4(0.0);
    for (int slot = run / SQUARES, turn = run; slot < u_slots; slot += stride, ++turn) {
        ivec2 tile = ivec2(slot % columns, slot / columns) * TILE_SQUARES;
        ivec2 square = tile + ivec2(turn % TILE_SQUARES, turn / TILE_SQUARES % TILE_SQUARES);
        vec4 one = texelFetch(t_candidates, square, 0);
        out_unshot += texelFetch(t_unshot, square, 0);
        out_run = vec4(one.x > out_run.x ? one.xyz : out_run.xyz, out_run.w + one.w);
    }
}
