// A point that is looked from, a row each, and the directions that it looks in: density cos θ / π, by two numbers of the R2 sequence
// [Roberts18], which is even in any number of rays, shifted at random for each row.
//
// [Roberts18] M. Roberts, The unreasonable effectiveness of quasirandom sequences, 2018.
#include "common/atlas.glsl"
#include "common/item.glsl"

uniform sampler2D t_nodes;  // a row each: (position, shift), (normal, shift), three more shifts

const float REACH = 2.0 * FAR;  // beyond the scene
const vec2 R2 = vec2(0.7548776662, 0.5698402910);               // 1 / φ₂, 1 / φ₂²: φ₂³ = φ₂ + 1
const vec3 R3 = vec3(0.8191725134, 0.6710436067, 0.5497004779);  // 1 / φ₃, 1 / φ₃², 1 / φ₃³: φ₃⁴ = φ₃ + 1

struct Node {
    vec3 origin;  // off its own surface
    vec3 normal;
    vec2 shift;
    vec3 lamp_shift;
};

Node node_of(int row) {
    vec4 position = texelFetch(t_nodes, ivec2(0, row), 0), normal = texelFetch(t_nodes, ivec2(1, row), 0);
    vec3 origin = position.xyz + 2.0 * COPLANAR * normal.xyz;
    return Node(origin, normal.xyz, vec2(position.w, normal.w), texelFetch(t_nodes, ivec2(2, row), 0).xyz);
}

vec3 direction_of(Node node, int ray) {
    vec2 u = fract(node.shift + float(ray) * R2);
    float r = sqrt(u.x), angle = 2.0 * PI * u.y;
    vec3 n = node.normal;
    float side = n.z < 0.0 ? -1.0 : 1.0, a = -1.0 / (side + n.z), b = n.x * n.y * a;  // [Duff17]
    vec3 s = vec3(1.0 + side * n.x * n.x * a, side * b, -side * n.x), t = vec3(b, side + n.y * n.y * a, -n.y);
    return r * cos(angle) * s + r * sin(angle) * t + sqrt(1.0 - u.x) * n;
}
