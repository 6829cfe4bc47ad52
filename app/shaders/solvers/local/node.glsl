// What is in the slots of the local set, see set_nodes of app/solvers/local/lighting.py.
#include "solvers/local/vector.glsl"

uniform sampler2D t_nodes;

struct Node {
    vec3 albedo;
    float area;     // in mean areas of a patch; 0: the slot is free
    int start, count;  // of its texels in order
    float outside;  // share of what it sees that is outside of the set
    float edge;     // [texels of level 0]
};

Node load_node(int slot) {
    vec4 a = texelFetch(t_nodes, at_slot(slot), 0), b = texelFetch(t_nodes, at_slot(slot, 1), 0);
    int start = int(b.x) + (int(texelFetch(t_nodes, at_slot(slot, 2), 0).z) << 16);
    return Node(a.rgb, a.a, start, int(b.y), b.z, b.w);
}
