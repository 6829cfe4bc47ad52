// What is seen from a direction: items, and depths.
#define OPACITY 0
#include "solvers/shooting/direction_shot.glsl"
#if OPACITY
#include "visibility/opacity.glsl"
uniform int u_sheer;  // rows of t_sheer
#endif

flat in vec2 v_sides;
flat in int v_map;
in vec3 v_place;

layout(location = 0) out float out_item;

void main() {
#if OPACITY
    int row = gl_PrimitiveID % u_sheer;
    if (chance_in_map(shooter_of(v_map).normal, ivec2(gl_FragCoord.xy), row) >= opacity_at(row, v_place)) discard;
#endif
    out_item = gl_FrontFacing ? v_sides.r : v_sides.g;
}
