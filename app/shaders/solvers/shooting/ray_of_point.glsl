// Where it is held what the rays of gather points hit: of a row of points, RAY_EDGE rows of as many rays of each. Rays along the
// same direction lie side by side: a processor that walks the tree for some at once is then not kept waiting by one of them.
//
// A point and its three neighbours look along four parts of one sequence of directions, and smooth_ambient.frag.glsl takes the
// mean of four such points: of four times as many rays. [Keller01, interleaved sampling]
#define RAY_EDGE  // squared: rays of a point
uniform int u_points;  // in a row; even

// Which of the four parts a point has.
int part_of(ivec2 block) { return (block.x & 1) + 2 * (block.y & 1); }

ivec2 px_of_ray(ivec2 block, int ray) {
    int half_row = (block.x & 1) * (u_points / 2);
    return ivec2((ray % RAY_EDGE) * u_points + half_row + block.x / 2, block.y * RAY_EDGE + ray / RAY_EDGE);
}

// The point of a pixel and, in z, which of its rays.
ivec3 ray_at(ivec2 px) {
    int column = px.x % u_points, half_row = column >= u_points / 2 ? 1 : 0;
    ivec2 block = ivec2(2 * (column - half_row * (u_points / 2)) + half_row, px.y / RAY_EDGE);
    return ivec3(block, px.y % RAY_EDGE * RAY_EDGE + px.x / u_points);
}
