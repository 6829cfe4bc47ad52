// Draws the hemicube, fragment side. Depth is linear: a perspective one cannot tell a lamp from its ceiling.
#include "common/item.glsl"
#include "visibility/projections/hemicube.glsl"

flat in vec2 v_sides;
flat in float v_own;

vec2 item_and_depth() {
    // the shooter's own polygon is edge-on: nothing of it may cover the rim
    bool own = v_sides.r == v_own || v_sides.g == v_own;
    return vec2(gl_FrontFacing ? v_sides.r : v_sides.g, own ? FAR : 1.0 / gl_FragCoord.w);
}
