// Light that comes back to a node that enters, σ = f_n + f·ρ k, over all paths among the others.
#include "solvers/local/vector.glsl"

uniform sampler2D t_column;
uniform sampler2D t_given;
uniform sampler2D t_list;
uniform int u_slot;
uniform int u_count;

layout(location = 0) out vec4 out_closed;

void main() {
    vec3 sum = texelFetch(t_given, at_slot(u_slot), 0).rgb;
    for (int n = 0; n < u_count; ++n) {
        vec4 seen = texelFetch(t_list, at_slot(n), 0);
        sum += seen.rgb * texelFetch(t_column, at_slot(int(seen.a)), 0).rgb;
    }
    out_closed = vec4(sum, 0.0);
}
