// Item and depth along the sight. The depth buffer gets the same, linear: a perspective one cannot tell a lamp from its ceiling.
#include "common/item.glsl"
#include "shooting/shooter_block.glsl"

flat in vec2 v_sides;

layout(location = 0) out vec2 out_sample;

void main() {
    float own = u_shooter_rows[1].w;
    // the shooter's own polygon is edge-on: nothing of it may cover the rim
    if (v_sides.r == own || v_sides.g == own) discard;
    float depth = 1.0 / gl_FragCoord.w;
    out_sample = vec2(gl_FrontFacing ? v_sides.r : v_sides.g, depth);
    gl_FragDepth = depth / FAR;
}
