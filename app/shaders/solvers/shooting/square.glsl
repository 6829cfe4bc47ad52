// Texels along the edge of a square, of which a batch takes one patch at most: 2^SQUARE_LEVEL.
#define SQUARE_LEVEL 3
