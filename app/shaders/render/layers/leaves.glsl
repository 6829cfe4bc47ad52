// A colour per level of the quadtree's leaves.
#include "common/tile.glsl"
#include "common/leaves.glsl"
#include "render/level_colour.glsl"

vec3 layer_colour(ivec2 texel_px) {
    float texel = texelFetch(t_leaves, texel_px / TILE, 0).z;
    return 0.8 * level_colour(-log2(max(texel, 1e-3)));
}

vec3 unlit_colour(int material) { return vec3(0.0); }
