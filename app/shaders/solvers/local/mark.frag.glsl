// The local set on every texel: level of the node from 1 (0: in none), its age [frames], its slot.
#include "direct_light/folded.glsl"
#include "solvers/local/node.glsl"

uniform usampler2D t_places;
uniform usampler2D t_slots;

layout(location = 0) out vec4 out_mark;

void main() {
    uint place = texelFetch(t_places, ivec2(gl_FragCoord.xy), 0).x;
    out_mark = vec4(0.0);
    if (place == 0xFFFFFFFFu) return;
    int slot = int(texelFetch(t_slots, folded(int(place)), 0).x) - 1;
    if (slot < 0) return;
    vec2 level_age = texelFetch(t_nodes, at_slot(slot, 2), 0).xy;
    out_mark = vec4(level_age.x + 1.0, level_age.y, float(slot), 0.0);
}
