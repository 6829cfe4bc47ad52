// Item and depth along the sight. The depth buffer gets the same, linear: a perspective one cannot tell a lamp from its ceiling.
#include "common/item.glsl"
#include "shooting/shooter_block.glsl"

uniform sampler2D t_sides;  // per triangle: item of its front, of its back

layout(location = 0) out vec2 out_sample;

void main() {
    int width = textureSize(t_sides, 0).x;
    vec2 sides = texelFetch(t_sides, ivec2(gl_PrimitiveID % width, gl_PrimitiveID / width), 0).rg;
    float own = u_shooter_rows[1].w;
    // the shooter's own polygon is edge-on: nothing of it may cover the rim
    if (sides.r == own || sides.g == own) discard;
    float depth = 1.0 / gl_FragCoord.w;
    out_sample = vec2(gl_FrontFacing ? sides.r : sides.g, depth);
    gl_FragDepth = depth / FAR;
}
