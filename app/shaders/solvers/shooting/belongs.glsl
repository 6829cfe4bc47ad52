// Which texels of a patch shoot together: those of one chart that face the shooter's way. Small charts share patches, and may be
// of other rooms. The rest keeps its residual and shoots later.
uniform sampler2D t_facets;

const float COS_TOGETHER = 0.94;  // 20°: cosines of one polygon are then right within 6 %

// Of a facet: ∂p/∂u and its chart, or, with ``which`` 1, ∂p/∂v.
vec4 facet_entry(uint facet, int which) {
    int entry = 2 * int(facet) + which;
    int width = textureSize(t_facets, 0).x;
    return texelFetch(t_facets, ivec2(entry % width, entry / width), 0);
}

float chart_of(uint facet) { return facet_entry(facet, 0).w; }

bool belongs(Texel texel, vec3 normal, float chart) {
    return texel.area > 0.0 && dot(texel.normal, normal) > COS_TOGETHER && chart_of(texel.facet) == chart;
}
