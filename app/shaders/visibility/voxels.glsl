// Whether a straight way between two points on surfaces is free, by the occupied cells of a grid: every cell that it passes is
// looked at [Amanatides87]. See app/visibility/voxels.py.
//
// The surfaces of both ends occupy the cells around these. A cell that a plane touches lies within its diagonal, √3 edges, of that
// plane: below such heights above either end nothing is looked at. What stands closer to a surface casts no shadow on it, and
// another surface that passes an end as closely may cast one.
uniform usampler2D t_voxels;  // 32 cells along x in each texel: (word + words · y, z)
uniform vec4 u_grid;          // lower corner, solver space; edge of a cell
uniform int u_cells;          // along an edge of the grid

const float DIAGONAL = 1.7320508;
const int WORD_BITS = 5;

bool occupied(ivec3 cell) {
    int words = u_cells >> WORD_BITS;
    uint word = texelFetch(t_voxels, ivec2((cell.x >> WORD_BITS) + words * cell.y, cell.z), 0).x;
    return (word >> (cell.x & 31) & 1u) != 0u;
}

bool free_way(vec3 from, vec3 from_normal, vec3 to, vec3 to_normal) {
    vec3 way = to - from;
    float least = DIAGONAL * u_grid.w;
    float first = least / dot(way, from_normal), last = 1.0 + least / dot(way, to_normal);
    if (!(first >= 0.0 && first < last)) return true;
    vec3 at = (from + first * way - u_grid.xyz) / u_grid.w, end = (from + last * way - u_grid.xyz) / u_grid.w;
    ivec3 cell = clamp(ivec3(floor(at)), 0, u_cells - 1), goal = clamp(ivec3(floor(end)), 0, u_cells - 1);
    ivec3 step = ivec3(sign(vec3(goal - cell)));
    vec3 each = 1.0 / max(abs(end - at), vec3(1e-12));  // share of the way through one cell
    vec3 next = each * mix(at - vec3(cell), vec3(cell) + 1.0 - at, greaterThan(end, at));
    ivec3 left = abs(goal - cell);
    for (int steps = left.x + left.y + left.z; ; --steps) {
        if (occupied(cell)) return false;
        if (steps == 0) return true;
        vec3 ahead = mix(vec3(1e30), next, greaterThan(left, ivec3(0)));
        if (ahead.x <= min(ahead.y, ahead.z)) { cell.x += step.x; next.x += each.x; --left.x; }
        else if (ahead.y <= ahead.z) { cell.y += step.y; next.y += each.y; --left.y; }
        else { cell.z += step.z; next.z += each.z; --left.z; }
    }
}
