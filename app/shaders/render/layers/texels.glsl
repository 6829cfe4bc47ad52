// Texel density: grey on target, blue up to 2 octaves too coarse, orange up to 2 too fine.
#include "common/atlas.glsl"
#include "common/facet.glsl"
uniform usampler2D t_normal_ids;
uniform float u_target_texel;  // edge of a texel at the density aimed at, solver space

vec3 layer_colour(ivec2 texel_px) {
    uint facet = facet_from_ids(texelFetch(t_normal_ids, texel_px, 0).y);
    vec3 dpdu = facet_entry(facet, 0).xyz, dpdv = facet_entry(facet, 1).xyz;
    float edge = sqrt(max(length(cross(dpdu, dpdv)), 1e-20));
    float octaves = clamp(0.5 * log2(u_target_texel / edge), -1.0, 1.0);
    vec3 tint = octaves < 0.0 ? vec3(0.05, 0.22, 0.75) : vec3(0.85, 0.28, 0.03);
    return mix(vec3(0.5), tint, abs(octaves));
}

vec3 unlit_colour(int material) { return vec3(0.0); }
