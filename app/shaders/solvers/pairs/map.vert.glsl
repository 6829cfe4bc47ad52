// The scene as some senders see it: every view of every map in one draw, one instance each.
#include <vertex>
#include "solvers/pairs/sender.glsl"
#include "common/hemisphere.glsl"
#define VIEWS 5

uniform int u_first;  // the sender of the first map
uniform int u_maps;   // that lie above each other in the target

void main() {
    int map = gl_InstanceID / VIEWS;
    Sender s = load_sender(u_first + map);
    draw(gl_InstanceID - map * VIEWS, s.position, frame_of(s.normal), s.facet, map, u_maps);
}
