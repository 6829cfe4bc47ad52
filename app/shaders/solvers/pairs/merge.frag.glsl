// Texels are merged into quadtree nodes where light and normal hardly change, and the tree is held in the texture itself [Kahl22]: the
// a of B is the number of texels that a sender stands for, 0 where it was merged into the first texel of its node.
//
// A texel goes into the largest node in which no texel differs from the mean by ½ (|ΔB| / B̄ + |Δn|) >= threshold, with B̄ the mean
// over all surfaces: what is merged does not depend on the unit of light.
#include "common/atlas.glsl"
#include "solvers/pairs/rows.glsl"

uniform sampler2D t_texels;  // column and row of each texel, part (a chart in a tile), place along the Morton curve in its tile
uniform sampler2D t_place;
uniform sampler2D t_facing;
uniform sampler2D t_sent;
uniform int u_senders;
uniform int u_level;  // of the largest nodes: 4^level texels
uniform float u_threshold;
uniform float u_mean;  // B̄, mean of RGB [stored units]

layout(location = 0) out vec4 out_sent;
layout(location = 1) out vec4 out_place;
layout(location = 2) out vec4 out_facing;

// Part, and number of the node in its tile.
ivec2 node_of(int k, int level) {
    vec2 at = texelFetch(t_texels, row_px(k), 0).zw;
    return ivec2(int(at.x), int(at.y) >> 2 * level);
}

void main() {
    int own = entry_at(gl_FragCoord.xy);
    out_sent = out_place = out_facing = vec4(0.0);
    if (own >= u_senders) return;
    for (int level = u_level; level >= 0; --level) {
        ivec2 node = node_of(own, level);
        int first = own, end = own + 1;
        while (first > 0 && node_of(first - 1, level) == node) --first;
        while (end < u_senders && node_of(end, level) == node) ++end;
        vec4 B = vec4(0.0), place = vec4(0.0);
        vec3 normal = vec3(0.0);
        for (int k = first; k < end; ++k) {
            vec4 p = texelFetch(t_place, row_px(k), 0);
            B += p.w * vec4(texelFetch(t_sent, row_px(k), 0).rgb, 1.0);
            place += p.w * vec4(p.xyz, 1.0);
            normal += p.w * texelFetch(t_facing, row_px(k), 0).xyz;
        }
        B.rgb /= B.w;
        normal = normalize(normal);
        float most = 0.0;
        for (int k = first; k < end && most < u_threshold; ++k) {
            vec3 light = abs(texelFetch(t_sent, row_px(k), 0).rgb - B.rgb);
            float bends = distance(texelFetch(t_facing, row_px(k), 0).xyz, normal);
            most = max(most, 0.5 * (dot(light, vec3(1.0 / 3.0)) / max(u_mean, 1e-30) + bends));
        }
        if (level > 0 && most >= u_threshold) continue;
        if (own == first) {
            out_sent = vec4(B.rgb, float(end - first));
            out_place = vec4(place.xyz / place.w, place.w);
            out_facing = vec4(normal, texelFetch(t_facing, row_px(own), 0).w);
        }
        return;
    }
}
