// Blocks of texels beside those of a leaf, which may lie in another leaf.
#include "common/texel_at.glsl"

// The block at a place in the leaf of a slot, or beside it [blocks]; negative where there is none.
ivec2 block_at(ivec2 block, ivec2 slot) {
    const int ACROSS = TILE / BLOCK;
    if (all(greaterThanEqual(block, ivec2(0))) && all(lessThan(block, ivec2(ACROSS)))) return slot * ACROSS + block;
    vec3 leaf = texelFetch(t_leaves, slot, 0).xyz;
    ivec2 px = texel_px_at((leaf.xy * float(TILE) + (vec2(block) + 0.5) * float(BLOCK)) * leaf.z);
    return px.y < 0 ? ivec2(-1) : px / BLOCK;
}
