// The points around a point, of the same chart and facing the same way.
#include "common/atlas.glsl"
#include "common/texel_at.glsl"

uniform usampler2D t_origin_normal;  // and the chart

const uint NO_CHART = 0xFFFFFFFFu;
const float COS_ALIKE = 0.94;  // 20°

struct Window {
    uint chart;
    vec3 normal;
    ivec2 px, inside;
    vec2 uv;
    float texel;
};

Window window_at(ivec2 px) {
    uvec2 mine = texelFetch(t_origin_normal, px, 0).xy;
    vec3 leaf = texelFetch(t_leaves, px / TILE, 0).xyz;
    ivec2 inside = px % TILE;
    vec2 uv = (leaf.xy * float(TILE) + vec2(inside) + 0.5) * leaf.z;
    return Window(mine.y, normal_from_octahedral(mine.x), px, inside, uv, leaf.z);
}

// The point so many texels away; negative where there is none, or none alike.
ivec2 beside(Window w, ivec2 step) {
    ivec2 at = w.inside + step, there = w.px + step;
    if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, ivec2(TILE)))) there = texel_px_at(w.uv + vec2(step) * w.texel);
    if (there.y < 0) return ivec2(-1);
    uvec2 other = texelFetch(t_origin_normal, there, 0).xy;
    return other.y == w.chart && dot(normal_from_octahedral(other.x), w.normal) >= COS_ALIKE ? there : ivec2(-1);
}
