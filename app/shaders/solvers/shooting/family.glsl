// Four patches of an emitter, of which one shoots for all at first: another one in neighbouring families, and in those of
// neighbouring squares, which shoot in step.
#include "solvers/shooting/square.glsl"

const int FAMILY = 2;  // patches along its edge

// Where the patch begins that shoots for the family at corner_px, of patches of a level
ivec2 speaker_of(ivec2 corner_px, int level) {
    ivec2 place = corner_px / (FAMILY << level) + (corner_px >> SQUARE_LEVEL);
    int member = (place.x + 2 * place.y) & 3;
    return corner_px + (ivec2(member & 1, member >> 1) << level);
}
