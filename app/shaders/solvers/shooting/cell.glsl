// Cells of texels: a batch takes one patch of each at most.
#define CELL_LEVEL  // a cell has 2^CELL_LEVEL texels along its edge
