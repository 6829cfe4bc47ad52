// An update of rank one, c k kᵀ, as the vector √|c| k with the sign of c, that waits to be added to the matrix.
#include "solvers/local/vector.glsl"

uniform sampler2D t_column;
uniform sampler2D t_closed;
uniform sampler2D t_given;  // a: 0 where the node was seen before
uniform int u_slot;
uniform vec3 u_albedo;  // ρ
uniform bool u_enters;
uniform bool u_exact;
uniform bool u_masked;  // what is taken back: of slots that the node was seen by before

const float LEAST = 1e-4;  // 1 - ρσ: rounding might make it negative where nearly all is reflected

layout(location = 0) out vec4 out_waiting;

void main() {
    int i = slot_at(ivec2(gl_FragCoord.xy));
    vec3 closed = u_enters ? -texelFetch(t_closed, ivec2(0), 0).rgb : texelFetch(t_column, at_slot(u_slot), 0).rgb;
    vec3 factor = u_albedo / (u_exact ? max(1.0 + u_albedo * closed, LEAST) : vec3(1.0));
    vec3 k = i == u_slot ? vec3(0.0) : texelFetch(t_column, at_slot(i), 0).rgb;
    if (u_masked) k *= 1.0 - texelFetch(t_given, at_slot(i), 0).a;
    out_waiting = vec4(sqrt(max(factor, 0.0)) * k, u_enters && !u_masked ? 1.0 : -1.0);
}
