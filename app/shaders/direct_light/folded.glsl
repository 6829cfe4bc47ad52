// Where the nth texel of a list is that is longer than a texture may be wide, and folded into rows, see app/direct_light/lit.py.
const int FOLD_BITS = 12;  // 2^FOLD_BITS of them lie in a row

ivec2 folded(int nth) { return ivec2(nth & ((1 << FOLD_BITS) - 1), nth >> FOLD_BITS); }
