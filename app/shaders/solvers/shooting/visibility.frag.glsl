// What the shooters of a batch see.
#include <fragment>
#include "visibility/draw_map.glsl"
