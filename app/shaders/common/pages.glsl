// From the virtual atlas to the node set, through the page table (slot = tile + 1, 0 = no tile). [Coombe03, 4.2]
uniform usampler2D t_pages;

// Column and row in the node set of an atlas tile; negative where there is no tile. Floats: exact up to 2^22 tiles, and
// far cheaper than integer division.
vec2 tile_from_page(ivec2 page, float columns) {
    float tile = float(texelFetch(t_pages, page, 0).x) - 1.0;
    float row = floor((tile + 0.5) / columns);
    return vec2(tile - row * columns, row);
}
