// The product of each vector that waits with ρf of a node that enters.
#include "solvers/local/vector.glsl"

uniform sampler2D t_waiting;
uniform sampler2D t_list;
uniform int u_count;

layout(location = 0) out vec4 out_sum;

void main() {
    int p = int(gl_FragCoord.x);
    vec3 sum = vec3(0.0);
    for (int n = 0; n < u_count; ++n) {
        vec4 seen = texelFetch(t_list, at_slot(n), 0);
        sum += seen.rgb * texelFetch(t_waiting, at_slot(int(seen.a), p), 0).rgb;
    }
    out_sum = vec4(sum, 0.0);
}
