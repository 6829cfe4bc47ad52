// The product of the matrix with a vector: the part of it that one of CHUNKS pieces of each row gives.
#include "solvers/local/matrix.glsl"
#include "solvers/local/vector.glsl"

uniform sampler2D t_vector;
uniform int u_most;
uniform bool u_coloured;  // whether the matrix has a number for each colour
uniform float u_scale;

layout(location = 0) out vec4 out_product;

const int CHUNKS = 16;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    int length = (u_most + CHUNKS - 1) / CHUNKS, first = px.x * length, last = min(first + length, u_most);
    vec3 sum = vec3(0.0);
    for (int j = first; j < last; ++j) {
        vec3 k = entry(px.y, j);
        sum += (u_coloured ? k : k.rrr) * texelFetch(t_vector, at_slot(j), 0).rgb;
    }
    out_product = vec4(u_scale * sum, 0.0);
}
