// Which gather points of its chart lie around every texel: lower left, lower right, upper left, upper right.
#include "solvers/shooting/around.glsl"
#include "solvers/shooting/gather_point.glsl"
#include "solvers/shooting/block_at.glsl"

layout(location = 0) out uvec4 out_around;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy), slot = px / TILE;
    Texel texel = load_texel(t_position_area, t_normal_ids, px);
    out_around = uvec4(NO_TEXEL);
    if (texel.area <= 0.0) return;
    ivec2 low = ivec2(floor((vec2(px - slot * TILE) + 0.5) / float(BLOCK) - 0.5));
    float chart = chart_of(texel.facet);
    for (int i = 0; i < 4; ++i) {
        ivec2 block = block_at(low + ivec2(i & 1, i >> 1), slot);
        Texel point = gather_point(max(block, 0));
        bool same = block.y >= 0 && point.area > 0.0 && chart_of(point.facet) == chart;
        out_around[i] = same ? uint(block.x) | uint(block.y) << 16 : NO_POINT;
    }
}
