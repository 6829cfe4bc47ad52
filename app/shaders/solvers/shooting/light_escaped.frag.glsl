// This sums how much of what point and spot lights send out goes beyond the scene or their range (r), or ends on black sides without
// texels (g), as escaped.frag.glsl does for patches.
#include "common/item.glsl"
#include "common/light.glsl"
#include <projection>
#include "solvers/shooting/shooter_block.glsl"
#define BLOCK 8

const int STRIDE = 4;

uniform sampler2D t_items;
uniform sampler2D t_depth;
uniform sampler2D t_weights;  // solid angles of the four in the middle of every 4×4 samples, see weights.frag.glsl
uniform int u_row;            // of the target, where the blocks of the first map begin

layout(location = 0) out vec2 out_escaped;

// Along one sample, as a share of what its shot sends out.
vec2 lost(Shooter s, Light light, vec2 px, float item, float depth) {
    int view = view_from_px(px);
    vec3 way = world_from_local(s, local_from_view(view, sight_from_px(view, px)) * FAR * depth) - s.origin;
    float there = item == OPEN ? 0.0 : within_range(light, dot(way, way));
    return within_cone(light, -normalize(way)) / s.area * vec2(1.0 - there, item == UNCHARTED ? there : 0.0);
}

void main() {
    ivec2 corner_px = (ivec2(gl_FragCoord.xy) - ivec2(0, u_row)) * BLOCK;
    int map = corner_px.y / int(MAP_PX.y);
    Shooter s = shooter_of(map);
    Light light = load_light(s.patch_x);
    vec2 px_to_uv = 1.0 / vec2(textureSize(t_items, 0)), sum = vec2(0.0);
    for (int j = 0; j < BLOCK; j += STRIDE)
        for (int i = 0; i < BLOCK; i += STRIDE) {
            ivec2 px = corner_px + ivec2(i, j), quad = px / STRIDE;
            vec4 weights = texelFetch(t_weights, ivec2(quad.x, quad.y % textureSize(t_weights, 0).y), 0);
            vec2 middle = vec2(px + STRIDE / 2), here = middle - vec2(0.0, float(map) * MAP_PX.y);
            vec4 items = textureGather(t_items, middle * px_to_uv), depths = textureGather(t_depth, middle * px_to_uv);
            sum += weights.x * lost(s, light, here + vec2(-0.5, 0.5), items.x, depths.x);
            sum += weights.y * lost(s, light, here + 0.5, items.y, depths.y);
            sum += weights.z * lost(s, light, here + vec2(0.5, -0.5), items.z, depths.z);
            sum += weights.w * lost(s, light, here - 0.5, items.w, depths.w);
        }
    out_escaped = sum;
}
