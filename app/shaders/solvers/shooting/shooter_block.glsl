// The shooters of this draw, as uniforms: t_shooters copied into a buffer on the GPU, each padded to a block of its own.
#include "solvers/shooting/shooter.glsl"
#define LIGHT 0  // 1: shooters are point and spot lights, whose normals may be shorter than 1 and scale their axes: point_shots.py
#define BATCH
#define BLOCK_ROWS  // vec4s from one shooter to the next

layout(std140) uniform ShooterBlock {
    vec4 u_shooter_rows[BATCH * BLOCK_ROWS];
};

uniform int u_first;  // the first shot of this draw, in the batch

Shooter shooter_of(int shot) {
    vec4 rows[SHOOTER_ROWS];
    for (int row = 0; row < SHOOTER_ROWS; ++row) rows[row] = u_shooter_rows[(u_first + shot) * BLOCK_ROWS + row];
    return shooter_from_rows(rows);
}

// Rows are the shooter's axes: +z its normal, +x along its first edge.
mat3 world_axes(Shooter s) {
    vec3 x = normalize(s.edge_u - s.normal * dot(s.edge_u, s.normal));
#if LIGHT
    x *= length(s.normal);
    return mat3(x, cross(normalize(s.normal), x), s.normal);
#else
    return mat3(x, cross(s.normal, x), s.normal);
#endif
}

vec3 world_from_local(Shooter s, vec3 local) {
#if LIGHT
    local /= dot(s.normal, s.normal);
#endif
    return s.origin + world_axes(s) * local;
}
