// Which tile-pool texel each display texel copies (column | row << 16), made anew when leaves come or go. A texel that covers
// nothing copies a neighbour that does, the nearest first, so that neither gutters nor tile borders darken the picture.
#include "common/atlas.glsl"
#include "common/pages.glsl"
#include "common/tile.glsl"
#include "render/display.glsl"

#define BORDER 1  // texels around each tile, so that the sampler can interpolate; two for bicubic
const int BORDERED = TILE + 2 * BORDER;

uniform sampler2D t_position_area;

layout(location = 0) out uint out_source;

const int REACHED = BORDER == 1 ? 9 : 25;  // those as far as the border is wide
const ivec2 NEIGHBOURS[25] = ivec2[](
    ivec2(0, 0), ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1),
    ivec2(1, 1), ivec2(-1, 1), ivec2(1, -1), ivec2(-1, -1),
    ivec2(2, 0), ivec2(-2, 0), ivec2(0, 2), ivec2(0, -2),
    ivec2(2, 1), ivec2(2, -1), ivec2(-2, 1), ivec2(-2, -1), ivec2(1, 2), ivec2(-1, 2), ivec2(1, -2), ivec2(-1, -2),
    ivec2(2, 2), ivec2(-2, 2), ivec2(2, -2), ivec2(-2, -2));

uint source_at(vec2 uv) {
    ivec2 slot = slot_at(uv);
    if (slot.y < 0) return NO_SOURCE;
    vec3 leaf = texelFetch(t_leaves, slot, 0).xyz;
    ivec2 inside = ivec2(floor(uv / leaf.z - leaf.xy * float(TILE)));
    ivec2 px = slot * TILE + clamp(inside, 0, TILE - 1);
    return texelFetch(t_position_area, px, 0).w > 0.0 ? uint(px.x) | uint(px.y) << 16 : NO_SOURCE;
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    ivec2 slot = px / BORDERED;
    vec3 leaf = texelFetch(t_leaves, slot, 0).xyz;
    vec2 texel = leaf.xy * float(TILE) + vec2(px - slot * BORDERED - BORDER) + 0.5;
    out_source = NO_SOURCE;
    for (int i = 0; i < REACHED && out_source == NO_SOURCE && leaf.z > 0.0; ++i)
        out_source = source_at((texel + vec2(NEIGHBOURS[i])) * leaf.z);
}
