// Whether texel i and sender j see each other, as it is kept.
#include "solvers/pairs/bits.glsl"

uniform usampler2D t_bits;

bool seen(int i, vec3 p, vec3 n, int j, vec3 q, vec3 m) {
    bool turned = u_reciprocal != 0 && i < j;
    int a = turned ? j : i, b = turned ? i : j;
    uint word = texelFetch(t_bits, word_px(first_word(a) + (b >> 5)), 0).x;
    return (word >> (b & 31) & 1u) != 0u;
}
