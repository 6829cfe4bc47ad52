// The matrix is symmetric: only what is on its diagonal and below, in row i and column j ≤ i, is kept.
uniform sampler2D t_matrix;

vec3 entry(int i, int j) { return texelFetch(t_matrix, i < j ? ivec2(i, j) : ivec2(j, i), 0).rgb; }
