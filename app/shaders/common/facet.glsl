// The table of facets, which are numbered from 1. See app/lightmap/textures.py.
uniform sampler2D t_facets;

// Of a facet: ∂p/∂u and its chart, or, with ``which`` 1, ∂p/∂v; solver space per texel of level 0.
vec4 facet_entry(uint facet, int which) {
    int entry = 2 * int(facet) + which;
    int width = textureSize(t_facets, 0).x;
    return texelFetch(t_facets, ivec2(entry % width, entry / width), 0);
}
