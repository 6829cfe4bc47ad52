// What each node sends, times the root of its area: the direct light that it reflects, and what else it receives.
#include "solvers/local/node.glsl"

uniform sampler2D t_reflected;
uniform sampler2D t_outside;
uniform sampler2D t_indirect;  // of the bounce before
uniform bool u_anew;           // whether the matrix holds all reflections: then only light from outside is left to be reflected

layout(location = 0) out vec4 out_sent;

void main() {
    int slot = slot_at(ivec2(gl_FragCoord.xy));
    Node node = load_node(slot);
    vec3 received = u_anew ? node.outside * texelFetch(t_outside, ivec2(0), 0).rgb : texelFetch(t_indirect, at_slot(slot), 0).rgb;
    out_sent = vec4(sqrt(node.area) * (texelFetch(t_reflected, at_slot(slot), 0).rgb + node.albedo * received), 0.0);
}
