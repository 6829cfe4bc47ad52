// All updates of rank one that wait, Σ ± k kᵀ, for the half of the matrix that is kept. Blended.
#include "solvers/local/vector.glsl"

uniform sampler2D t_waiting;
uniform int u_pending;
uniform float u_scale;

layout(location = 0) out vec4 out_matrix;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    vec3 sum = vec3(0.0);
    for (int p = 0; p < u_pending; ++p) {
        vec4 row = texelFetch(t_waiting, at_slot(px.y, p), 0);
        sum += row.a * row.rgb * texelFetch(t_waiting, at_slot(px.x, p), 0).rgb;
    }
    out_matrix = vec4(u_scale * sum, 0.0);
}
