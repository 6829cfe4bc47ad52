#define TILE  // texels along the edge of a leaf tile
