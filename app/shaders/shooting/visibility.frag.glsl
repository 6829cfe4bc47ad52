// Item and depth along the sight. The depth buffer gets the same, linear: a perspective one cannot tell a lamp from its ceiling.
#include "common/item.glsl"

flat in uvec2 v_facets;

layout(location = 0) out vec2 out_sample;

void main() {
    uint facet = gl_FrontFacing ? v_facets.x : v_facets.y;
    float depth = 1.0 / gl_FragCoord.w;
    out_sample = vec2(facet == 0u ? UNCHARTED : float(facet), depth);
    gl_FragDepth = depth / FAR;
}
