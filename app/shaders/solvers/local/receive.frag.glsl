// The indirect light of each node, from outside and from the set.
#include "solvers/local/node.glsl"

uniform sampler2D t_product;  // of the matrix with what was sent, in pieces
uniform sampler2D t_outside;

layout(location = 0) out vec4 out_indirect;

void main() {
    int slot = slot_at(ivec2(gl_FragCoord.xy));
    Node node = load_node(slot);
    vec3 sum = vec3(0.0);
    for (int n = textureSize(t_product, 0).x - 1; n >= 0; --n) sum += texelFetch(t_product, ivec2(n, slot), 0).rgb;
    vec3 outside = node.outside * texelFetch(t_outside, ivec2(0), 0).rgb;
    out_indirect = node.area > 0.0 ? vec4(outside + sum / sqrt(node.area), 1.0) : vec4(0.0);
}
