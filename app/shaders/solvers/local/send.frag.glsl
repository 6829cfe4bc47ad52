// What each node sends, times the root of its area: it reflects what it receives by the first bounce, or by all so far.
#include "solvers/local/first.glsl"

uniform sampler2D t_indirect;  // of the bounce before
uniform bool u_anew;           // whether the matrix holds all reflections: then only the first bounce is left to be reflected

layout(location = 0) out vec4 out_sent;

void main() {
    int slot = slot_at(ivec2(gl_FragCoord.xy));
    Node node = load_node(slot);
    vec3 received = u_anew ? first_of(slot, node) : texelFetch(t_indirect, at_slot(slot), 0).rgb;
    out_sent = vec4(sqrt(node.area) * node.albedo * received, 0.0);
}
