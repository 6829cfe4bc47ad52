// Where the bit of a pair is kept [Kahl22]: texel i sees sender j. Where the first u_senders texels are the senders themselves, one
// bit is kept for (i, j) and (j, i): texel i has bits for j <= i only, in ⌊i/32⌋ + 1 words.
uniform int u_senders;
uniform int u_reciprocal;
uniform int u_width;  // of the texture [words]

ivec2 word_px(int word) { return ivec2(word % u_width, word / u_width); }

// Words before those of a texel, if it and all before it are senders: Σ_{k<i} (⌊k/32⌋ + 1)
int triangle(int i) {
    int q = i >> 5;
    return (q + 1) * (16 * q + (i & 31));
}

int first_word(int i) {
    int each = (u_senders + 31) >> 5;
    if (u_reciprocal == 0) return i * each;
    return i < u_senders ? triangle(i) : triangle(u_senders) + (i - u_senders) * each;
}

// The texel that a word belongs to.
int texel_of_word(int word) {
    int each = (u_senders + 31) >> 5;
    if (u_reciprocal == 0) return word / each;
    int senders = triangle(u_senders);
    if (word >= senders) return u_senders + (word - senders) / each;
    int q = int(0.5 * (sqrt(1.0 + 0.25 * float(word)) - 1.0));  // 16 q (q + 1) <= word, but for rounding
    while (16 * q * (q + 1) > word) --q;
    while (16 * (q + 1) * (q + 2) <= word) ++q;
    return 32 * q + (word - 16 * q * (q + 1)) / (q + 1);
}
