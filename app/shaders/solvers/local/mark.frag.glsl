// The local set on every texel: level of the node from 1 (0: in none), pieces of work since it entered, the number of its colour.
#include "direct_light/folded.glsl"
#include "solvers/local/node.glsl"
#include "solvers/local/place.glsl"

uniform usampler2D t_places;
uniform usampler2D t_slots;
uniform float u_now;  // pieces of work so far

layout(location = 0) out vec4 out_mark;

void main() {
    uint place = texelFetch(t_places, ivec2(gl_FragCoord.xy), 0).x;
    out_mark = vec4(0.0);
    if (place == LOST) return;
    int slot = int(texelFetch(t_slots, folded(int(place)), 0).x) - 1;
    if (slot < 0) return;
    vec4 node = texelFetch(t_nodes, at_slot(slot, 2), 0);
    out_mark = vec4(node.x + 1.0, u_now - node.y, node.w, 0.0);
}
