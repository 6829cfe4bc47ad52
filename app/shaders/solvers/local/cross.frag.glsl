// What the matrix has in the row and the column of a slot.
#include "solvers/local/vector.glsl"

uniform sampler2D t_column;
uniform sampler2D t_closed;
uniform int u_slot;
uniform vec3 u_albedo;
uniform bool u_exact;
uniform float u_scale;

const float LEAST = 1e-4;  // as in wait.frag.glsl

layout(location = 0) out vec4 out_matrix;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    int i = px.x == u_slot ? px.y : px.x;
    vec3 k = texelFetch(t_column, at_slot(i), 0).rgb;
    if (u_exact) {
        vec3 closed = texelFetch(t_closed, ivec2(0), 0).rgb;
        if (i == u_slot) k = closed;
        k /= max(1.0 - u_albedo * closed, LEAST);
    }
    out_matrix = vec4(u_scale * k, 0.0);
}
