// Border texels of leaves next to leaves of another level, so that both sides interpolate to the same light: no T-vertices.
// [Coombe03, 4.4]
//
// Interpolation at an edge weighs the n-th texels on its two sides alike. So both leaves agree along it if, for every n, the sum of
// a leaf's own n-th texel and of its n-th border texel is the same for both. Next to a finer leaf the border is the mean h of the
// four texels that it covers, and the sum is c + h; the finer leaf follows with g = c + h - f, with c and h interpolated along the
// edge. The sums are of what is shown, since that is what the sampler interpolates. Where light is linear, g goes on as f does.
//
// The texels of an instance lie side by side here, and are brought to their places by border.frag.glsl: they are dear, and a strip as
// thin as a border would leave most of a rasteriser's blocks of fragments empty.
#include "common/atlas.glsl"
#include "common/pages.glsl"
#include "common/tile.glsl"
#include "common/colour.glsl"
#define FOLLOWS 0
uniform sampler2D t_position_area;
uniform float u_gain;  // exposure
uniform int u_border;  // texels around each tile
uniform int u_along;   // texels in a row of an instance, which has u_border rows
uniform sampler2D t_edges;  // of each instance: its corner [display texels], and towards the neighbour: -1, 0 or 1, both not 0 at a corner

layout(location = 0) out vec4 out_colour;

#include <layer>
#include <curve>
#include "render/shown.glsl"

vec3 exposed(vec3 colour) { return shown(colour * u_gain); }

vec3 own_or(vec3 otherwise, ivec2 texel_px) {
    return texelFetch(t_position_area, texel_px, 0).w > 0.0 ? layer_colour(texel_px) : otherwise;
}

#if FOLLOWS
// g beside a coarser leaf. inside: the own n-th texel opposite; mirrored in the edge, the middle of four own texels is that of a
// coarser one.
vec3 border_texel(vec3 f, ivec2 slot, vec3 leaf, ivec2 inside, ivec2 other, vec3 near, vec2 at, vec2 outward) {
    ivec2 across = abs(ivec2(outward)), along = 1 - across;
    bool lower = outward.x + outward.y < 0.0;
    int from_low = inside.x * across.x + inside.y * across.y;
    int n = lower ? from_low : TILE - 1 - from_low;
    float pair = 0.5 * dot(vec2(inside), vec2(along)) - 0.25;
    float base = clamp(floor(pair), 0.0, float(TILE / 2 - 2));
    vec3 c[2], h[2];
    for (int k = 0; k < 2; ++k) {
        ivec2 four = 2 * (int(base) + k) * along + (lower ? 2 * n : TILE - 2 - 2 * n) * across;
        vec2 middle = vec2(four) + 1.0 + outward * float(4 * n + 2);
        ivec2 coarse = ivec2(floor((leaf.xy * float(TILE) + middle) * (leaf.z / near.z) - near.xy * float(TILE)));
        c[k] = own_or(f, other * TILE + clamp(coarse, 0, TILE - 1));
        h[k] = vec3(0.0);
        for (int i = 0; i < 4; ++i) h[k] += 0.25 * own_or(f, slot * TILE + four + ivec2(i & 1, i >> 1));
    }
    return exposed(mix(c[0], c[1], pair - base)) + exposed(mix(h[0], h[1], pair - base)) - exposed(f);
}
#else
// Between four texels of the other leaf: h beside a finer one. At a corner of a coarser one, from beyond its outermost texels, on the
// line through the last two.
vec3 border_texel(vec3 f, ivec2 slot, vec3 leaf, ivec2 inside, ivec2 other, vec3 near, vec2 at, vec2 outward) {
    vec2 base = clamp(floor(at - 0.5), 0.0, float(TILE - 2)), share = at - 0.5 - base;
    ivec2 first = other * TILE + ivec2(base);
    vec3 below = mix(own_or(f, first), own_or(f, first + ivec2(1, 0)), share.x);
    vec3 above = mix(own_or(f, first + ivec2(0, 1)), own_or(f, first + ivec2(1, 1)), share.x);
    return exposed(mix(below, above, share.y));
}
#endif

void main() {
    int bordered = TILE + 2 * u_border, each = u_along * u_border;
    ivec2 here = ivec2(gl_FragCoord.xy);
    int nth = here.x % each;
    vec4 edge = texelFetch(t_edges, ivec2(here.x / each, here.y), 0);
    ivec2 steps = ivec2(nth % u_along, nth / u_along);
    ivec2 px = ivec2(edge.xy) + (edge.w == 0.0 ? steps.yx : steps), slot = px / bordered;
    ivec2 place = px - slot * bordered - u_border;
    ivec2 inside = max(place, -1 - place);
    inside = min(inside, 2 * TILE - 1 - inside);
    vec3 leaf = texelFetch(t_leaves, slot, 0).xyz;
    vec2 uv = (leaf.xy * float(TILE) + vec2(place) + 0.5) * leaf.z;
    ivec2 other = max(slot_at(uv), 0);
    vec3 near = texelFetch(t_leaves, other, 0).xyz;
    vec2 at = uv / max(near.z, 1e-9) - near.xy * float(TILE);  // in the neighbour [its texels]
    vec3 f = own_or(layer_colour(other * TILE + clamp(ivec2(floor(at)), 0, TILE - 1)), slot * TILE + inside);
    out_colour = vec4(border_texel(f, slot, leaf, inside, other, near, at, edge.zw), 1.0);
}
