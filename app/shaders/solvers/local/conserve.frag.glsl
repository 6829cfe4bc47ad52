// The factor that brings what rays find at their ends, over all nodes, to what they carry there from where they start.
#include "solvers/local/node.glsl"

uniform sampler2D t_first;
uniform sampler2D t_carried;
uniform int u_most;

layout(location = 0) out vec4 out_scale;

void main() {
    vec3 found = vec3(0.0), carried = vec3(0.0);
    for (int slot = 0; slot < u_most; ++slot) {
        float area = load_node(slot).area;
        found += area * texelFetch(t_first, at_slot(slot), 0).rgb;
        carried += area * texelFetch(t_carried, at_slot(slot), 0).rgb;
    }
    bvec3 lit = greaterThan(min(found, carried), vec3(1e-30));
    out_scale = vec4(mix(vec3(1.0), carried / max(found, vec3(1e-30)), lit), 1.0);
}
