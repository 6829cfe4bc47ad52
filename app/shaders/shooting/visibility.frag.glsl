// Item, and depth along the sight. Depth is linear: a perspective one cannot tell a lamp from its ceiling.
#include "common/item.glsl"

flat in vec2 v_sides;
flat in float v_own;

layout(location = 0) out float out_item;

void main() {
    out_item = gl_FrontFacing ? v_sides.r : v_sides.g;
    // the shooter's own polygon is edge-on: nothing of it may cover the rim; at FAR it loses against the open
    bool own = v_sides.r == v_own || v_sides.g == v_own;
    gl_FragDepth = own ? 1.0 : 1.0 / (gl_FragCoord.w * FAR);
}
