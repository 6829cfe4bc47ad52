// Made once: which node-set texel each display texel copies (column | row << 16). A texel that covers nothing copies a
// neighbour that does, the nearest first, so that neither gutters nor tile borders darken the picture.
#include "common/atlas.glsl"
#include "common/pages.glsl"
#include "render/display.glsl"

uniform usampler2D t_leaves;  // atlas tile of each tile of the node set; more than the atlas has where there is none
uniform sampler2D t_position_area;
uniform float u_columns;

layout(location = 0) out uint out_source;

const ivec2 NEIGHBOURS[9] = ivec2[](
    ivec2(0, 0), ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1),
    ivec2(1, 1), ivec2(-1, 1), ivec2(1, -1), ivec2(-1, -1));

uint source_at(ivec2 atlas_px) {
    ivec2 page = atlas_px >> 4;
    if (any(lessThan(page, ivec2(0))) || any(greaterThanEqual(page, textureSize(t_pages, 0)))) return NO_SOURCE;
    ivec2 tile = ivec2(tile_from_page(page, u_columns));
    if (tile.y < 0) return NO_SOURCE;
    ivec2 px = tile * TILE + (atlas_px & (TILE - 1));
    return texelFetch(t_position_area, px, 0).w > 0.0 ? uint(px.x) | uint(px.y) << 16 : NO_SOURCE;
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    ivec2 tile = px / BORDERED;
    ivec2 atlas_px = ivec2(texelFetch(t_leaves, tile, 0).xy) * TILE + px - tile * BORDERED - 1;
    out_source = NO_SOURCE;
    for (int i = 0; i < 9 && out_source == NO_SOURCE; ++i) out_source = source_at(atlas_px + NEIGHBOURS[i]);
}
