// The light that comes from outside of the set, taken as the mean of what nodes in it reflect; a: its share of indirect light.
#include "solvers/local/node.glsl"

uniform sampler2D t_reflected;
uniform sampler2D t_indirect;
uniform int u_most;

layout(location = 0) out vec4 out_outside;

void main() {
    vec3 sent = vec3(0.0), received = vec3(0.0);
    float area = 0.0, outside = 0.0;
    for (int slot = 0; slot < u_most; ++slot) {
        Node node = load_node(slot);
        vec3 indirect = texelFetch(t_indirect, at_slot(slot), 0).rgb;
        sent += node.area * (texelFetch(t_reflected, at_slot(slot), 0).rgb + node.albedo * indirect);
        received += node.area * indirect;
        area += node.area;
        outside += node.area * max(node.outside, 0.0);
    }
    vec3 mean = max(sent, 0.0) / max(area, 1e-30);
    float all = dot(received, vec3(1.0));
    out_outside = vec4(mean, all > 0.0 ? outside * dot(mean, vec3(1.0)) / all : 0.0);
}
