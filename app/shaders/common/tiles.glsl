#define TILE 16

// A corner of a tile's quad (two triangles, six vertices) in the node set.
vec4 tile_corner(ivec2 tile, vec2 size_px) {
    int corner = gl_VertexID % 6;
    vec2 at = vec2(corner == 1 || corner == 2 || corner == 4, corner == 2 || corner == 4 || corner == 5);
    return vec4((vec2(tile) + at) * float(TILE) / size_px * 2.0 - 1.0, 0.0, 1.0);
}
