// What some senders see.
#define OPACITY 0
#include <fragment>
#if OPACITY
#include "solvers/pairs/sender.glsl"
#include "common/hemisphere.glsl"

uniform int u_first;  // the sender of the first map

vec3 seen_from(int map) { return load_sender(u_first + map).position; }

vec3 place_seen(int map, vec3 local) {
    Sender s = load_sender(u_first + map);
    return s.position + frame_of(s.normal) * local;
}
#endif
#include "visibility/draw_map.glsl"
