// Vectors with a number for each slot are textures of ROW texels a row: as squares of pixels are drawn, one long row would waste most.
#define VECTOR_ROWS  // of each vector

const int ROW = 64;

ivec2 at_slot(int slot) { return ivec2(slot & (ROW - 1), slot / ROW); }
ivec2 at_slot(int slot, int vector) { return ivec2(slot & (ROW - 1), slot / ROW + vector * VECTOR_ROWS); }
int slot_at(ivec2 px) { return px.x + ROW * (px.y % VECTOR_ROWS); }
