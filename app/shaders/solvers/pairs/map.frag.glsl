// What some senders see.
#include <fragment>
#include "visibility/draw_map.glsl"
