#define TILE 16  // texels along the edge of a leaf tile
