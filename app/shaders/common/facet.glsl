// The table of facets, which are numbered from 1. See app/lightmap/tile_pool.py.
uniform sampler2D t_facets;

const int FACET_ENTRIES = 4;

// Of a facet: ∂p/∂u and its chart; with ``which`` 1, ∂p/∂v; with 2, its plane, a unit normal n and n · p; with 3, where
// u = v = 0 would be. Solver space, tangents per texel of level 0.
vec4 facet_entry(uint facet, int which) {
    int entry = FACET_ENTRIES * int(facet) + which;
    int width = textureSize(t_facets, 0).x;
    return texelFetch(t_facets, ivec2(entry % width, entry / width), 0);
}

float chart_of(uint facet) { return facet_entry(facet, 0).w; }
