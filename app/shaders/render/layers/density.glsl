// Texel density: texels along a metre of surface, also where leaves of a quadtree are finer than its roots.
#include "common/atlas.glsl"
#include "common/facet.glsl"
#include "common/tile.glsl"
#include "common/leaves.glsl"
uniform usampler2D t_normal_ids;
uniform float u_metre;  // a metre in solver space

vec3 layer_colour(ivec2 texel_px) {
    uint facet = facet_from_ids(texelFetch(t_normal_ids, texel_px, 0).y);
    vec3 dpdu = facet_entry(facet, 0).xyz, dpdv = facet_entry(facet, 1).xyz;
    float edge = sqrt(length(cross(dpdu, dpdv))) * texelFetch(t_leaves, texel_px / TILE, 0).z;
    return vec3(u_metre / max(edge, 1e-10));
}

vec3 unlit_colour(int material) { return vec3(0.0); }
