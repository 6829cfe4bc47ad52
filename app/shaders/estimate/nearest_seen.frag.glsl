// The first of four helpers, nearest first, that a node sees, and that faces it. Helpers are the last of the nodes.
#include "common/item.glsl"
#include "visibility/rays.glsl"

uniform sampler2D t_all_nodes;  // a column each: position, normal
uniform sampler2D t_candidates;  // a row for each node that looks, a texel for each of its links: four helpers
uniform int u_first;             // node of the first row
uniform int u_helpers;           // node of the first helper

layout(location = 0) out vec4 out_node;  // -1: none

vec3 normal_of(int node) { return texelFetch(t_all_nodes, ivec2(node, 1), 0).xyz; }

vec3 origin_of(int node) { return texelFetch(t_all_nodes, ivec2(node, 0), 0).xyz + 2.0 * COPLANAR * normal_of(node); }

bool sees(int from, int to) {
    vec3 origin = origin_of(from), away = origin_of(to) - origin;
    return dot(away, normal_of(from)) > 0.0 && dot(away, normal_of(to)) < 0.0 && !any_hit(origin, away, 0.0, 1.0);
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    vec4 candidates = texelFetch(t_candidates, px, 0);
    out_node = vec4(-1.0);
    for (int i = 0; i < 4 && out_node.x < 0.0; ++i)
        if (candidates[i] >= 0.0 && sees(u_first + px.y, u_helpers + int(candidates[i]))) out_node.x = candidates[i];
}
