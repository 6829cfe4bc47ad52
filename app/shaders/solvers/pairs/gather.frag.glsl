// What texels receive from some of the senders: Σ_j B_j F_ij V_ij, and in a Σ_j F_ij V_ij. Blended. [Kahl22]
//
//   CHOICE 0, each       a sender of its own number
//   CHOICE 1, by chance  of each window one of its texels, evenly chosen anew for every texel and pass; n F stands for all n of them:
//                        the mean over all choices is the sum over all texels
//   CHOICE 2, merged     all texels are looked at, those that were merged into another have 0 in the a of B
#define CHOICE 0
#include "solvers/pairs/sender.glsl"
#include <occlusion>
#if CHOICE == 1
#include "common/sequence.glsl"
uniform sampler2D t_windows;  // first texel of each window, and how many
uniform int u_pass;
#endif

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform usampler2D t_number;  // of each texel, from 1
uniform sampler2D t_sent;     // B of each sender [stored units]
uniform ivec2 u_range;        // the first sender or window, and how many

layout(location = 0) out vec4 out_received;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    out_received = vec4(0.0);
    int i = int(texelFetch(t_number, px, 0).x) - 1;
    if (i < 0) return;
    Texel texel = load_texel(t_position_area, t_normal_ids, px);
    for (int k = u_range.x; k < u_range.x + u_range.y; ++k) {
        int j = k;
#if CHOICE == 1
        vec2 window = texelFetch(t_windows, row_px(k), 0).xy;
        float share = float(hash(uvec3(i, k, u_pass)).x >> 8) / 16777216.0;
        j = int(window.x) + int(share * window.y);
#elif CHOICE == 2
        if (texelFetch(t_sent, row_px(j), 0).a <= 0.0) continue;
#endif
        Sender s = load_sender(j);
        float F = form_factor(texel.position, texel.normal, s);
#if CHOICE == 1
        F *= window.y;
#endif
        if (F > 0.0 && seen(i, texel.position, texel.normal, j, s.position, s.normal))
            out_received += F * vec4(texelFetch(t_sent, row_px(j), 0).rgb, 1.0);
    }
}
