// What the shooters of a batch see.
#define OPACITY 0
#include <fragment>
#if OPACITY
#include "solvers/shooting/shooter_block.glsl"

vec3 seen_from(int map) { return shooter_of(map).origin; }

vec3 place_seen(int map, vec3 local) { return world_from_local(shooter_of(map), local); }
#endif
#include "visibility/draw_map.glsl"
