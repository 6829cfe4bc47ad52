// Groups of an emitter's patches. One of each, its representative, shoots for all at first: another one in neighbouring groups,
// and in those of neighbouring cells, which shoot in step.
#include "solvers/shooting/cell.glsl"
#define GROUP  // patches along the edge of a group: 2

// Where the representative begins of the group at corner_px, of patches of a level.
ivec2 representative_of(ivec2 corner_px, int level) {
    ivec2 place = corner_px / (GROUP << level) + (corner_px >> CELL_LEVEL);
    int member = (place.x + 2 * place.y) & 3;
    return corner_px + (ivec2(member & 1, member >> 1) << level);
}
