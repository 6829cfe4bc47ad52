// The column of a node that enters, k = f + S ρ f, or of one that leaves, its column of S; what waits is part of K.
#include "solvers/local/matrix.glsl"
#include "solvers/local/vector.glsl"

uniform sampler2D t_waiting;  // vectors; a: their sign
uniform sampler2D t_given;    // f
uniform sampler2D t_list;     // ρf of the nodes that it sees; a: their slots
uniform sampler2D t_sums;     // of what waits, see dots.frag.glsl
uniform int u_slot;
uniform int u_count;  // of the list; negative of a node that leaves
uniform int u_pending;
uniform float u_scale;  // of what is stored

layout(location = 0) out vec4 out_column;

void main() {
    int i = slot_at(ivec2(gl_FragCoord.xy));
    vec3 k = vec3(0.0);
    if (u_count < 0) {
        k = u_scale * entry(i, u_slot);
        for (int p = 0; p < u_pending; ++p) {
            vec4 mine = texelFetch(t_waiting, at_slot(u_slot, p), 0);
            k += mine.a * mine.rgb * texelFetch(t_waiting, at_slot(i, p), 0).rgb;
        }
    } else if (i != u_slot) {
        for (int n = 0; n < u_count; ++n) {
            vec4 seen = texelFetch(t_list, at_slot(n), 0);
            k += seen.rgb * entry(i, int(seen.a));
        }
        k = u_scale * k + texelFetch(t_given, at_slot(i), 0).rgb;
        for (int p = 0; p < u_pending; ++p) {
            vec4 waiting = texelFetch(t_waiting, at_slot(i, p), 0);
            k += waiting.a * waiting.rgb * texelFetch(t_sums, ivec2(p, 0), 0).rgb;
        }
    }
    out_column = vec4(k, 1.0);
}
