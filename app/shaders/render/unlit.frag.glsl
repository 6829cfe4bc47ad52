// Sides without texels, because nothing lies before them, still emit: one colour per material, front (row 0) and back.
#include "common/colour.glsl"
uniform usampler2D t_sides;  // per material: 1 = reflects and emits at its back too
uniform float u_gain;        // exposure

layout(location = 0) out vec4 out_colour;

// unlit_colour(material): linear Rec.709
#include <layer>
// develop(rgb): linear Rec.709 of the screen, 0 to 1
#include <curve>
#include "render/shown.glsl"

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    bool seen = px.y == 0 || texelFetch(t_sides, ivec2(px.x, 0), 0).x > 0u;
    out_colour = vec4(shown(seen ? unlit_colour(px.x) * u_gain : vec3(0.0)), 1.0);
}
