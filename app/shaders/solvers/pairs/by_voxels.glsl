// Whether texel i and sender j see each other: the cells of a grid between them, always from the lower number to the higher, so
// that it says the same both ways.
#include "visibility/voxels.glsl"

bool seen(int i, vec3 p, vec3 n, int j, vec3 q, vec3 m) { return i < j ? free_way(p, n, q, m) : free_way(q, m, p, n); }
