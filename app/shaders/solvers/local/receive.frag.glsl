// The indirect light of each node, of the first bounce and all others.
#include "solvers/local/first.glsl"

uniform sampler2D t_product;  // of the matrix with what was sent, in pieces

layout(location = 0) out vec4 out_indirect;

void main() {
    int slot = slot_at(ivec2(gl_FragCoord.xy));
    Node node = load_node(slot);
    vec3 sum = vec3(0.0);
    for (int n = textureSize(t_product, 0).x - 1; n >= 0; --n) sum += texelFetch(t_product, ivec2(n, slot), 0).rgb;
    out_indirect = node.area > 0.0 ? vec4(first_of(slot, node) + sum / sqrt(node.area), 1.0) : vec4(0.0);
}
