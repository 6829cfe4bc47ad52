// The indirect light that is shown of each node: when nodes come and go, what was shown before, and from then on what it is now and a
// difference that fades.
#include "solvers/local/vector.glsl"

uniform sampler2D t_indirect;
uniform sampler2D t_shown;   // before
uniform sampler2D t_faded;   // the difference before
uniform sampler2D t_from;    // the slot in which what was shown of this node was, negative: in none
uniform sampler2D t_outside;
uniform float u_stays;
uniform bool u_swapped;

layout(location = 0) out vec4 out_shown;
layout(location = 1) out vec4 out_faded;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    vec4 indirect = texelFetch(t_indirect, px, 0);
    float from = texelFetch(t_from, px, 0).r;
    vec4 before = from < 0.0 ? texelFetch(t_outside, ivec2(0), 0) : texelFetch(t_shown, at_slot(int(from)), 0);
    out_faded = u_swapped ? before - indirect : u_stays * texelFetch(t_faded, px, 0);
    out_shown = max(indirect + out_faded, 0.0);
}
