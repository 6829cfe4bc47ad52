// The slots of the tiles around each slot: 3×3 places, that of the tile itself in the middle.
#include "common/pages.glsl"
#include "common/tile.glsl"

layout(location = 0) out uvec2 out_slot;  // column and row; of no use where there is none

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy), slot = place / 3;
    vec3 leaf = texelFetch(t_leaves, slot, 0).xyz;
    out_slot = uvec2(slot_at((leaf.xy + vec2(place - 3 * slot) - 0.5) * float(TILE) * leaf.z));
}
