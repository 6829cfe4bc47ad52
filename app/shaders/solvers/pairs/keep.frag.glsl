// Which of 32 senders a texel sees, a bit each.
#include "solvers/pairs/sender.glsl"
#include "solvers/pairs/bits.glsl"
#include <occlusion>

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_texels;  // column and row of each texel in the tile pool
uniform int u_words;

layout(location = 0) out uint out_bits;

void main() {
    int word = int(gl_FragCoord.x) + int(gl_FragCoord.y) * u_width;
    out_bits = 0u;
    if (word >= u_words) return;
    int i = texel_of_word(word), first = (word - first_word(i)) << 5;
    int end = min(first + 32, u_reciprocal != 0 && i < u_senders ? i + 1 : u_senders);
    Texel texel = load_texel(t_position_area, t_normal_ids, ivec2(texelFetch(t_texels, row_px(i), 0).xy));
    for (int j = first; j < end; ++j) {
        Sender s = load_sender(j);
        if (form_factor(texel.position, texel.normal, s) <= 0.0) continue;
        if (seen(i, texel.position, texel.normal, j, s.position, s.normal)) out_bits |= 1u << (j - first);
    }
}
