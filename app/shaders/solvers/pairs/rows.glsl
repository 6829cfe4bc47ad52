// Tables of numbered entries: 2^ENTRY_BITS lie in a row of their texture. See app/solvers/pairs/senders.py.
const int ENTRY_BITS = 10;

ivec2 row_px(int entry) { return ivec2(entry & ((1 << ENTRY_BITS) - 1), entry >> ENTRY_BITS); }
int entry_at(vec2 px) { return int(px.x) + (int(px.y) << ENTRY_BITS); }
