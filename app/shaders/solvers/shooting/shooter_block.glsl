// The shooters of this draw, as uniforms: t_shooters copied into a buffer on the GPU, each padded to a block of its own.
#include "solvers/shooting/shooter.glsl"
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
