// The texel of the tile pool at a place of the atlas [texels of level 0]; negative where there is none.
#include "common/pages.glsl"
#include "common/tile.glsl"

ivec2 texel_px_at(vec2 uv) {
    ivec2 slot = slot_at(uv);
    if (slot.y < 0) return ivec2(-1);
    vec3 leaf = texelFetch(t_leaves, slot, 0).xyz;
    return slot * TILE + clamp(ivec2(floor(uv / leaf.z - leaf.xy * float(TILE))), 0, TILE - 1);
}
