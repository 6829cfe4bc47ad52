// The shooter of this draw, as uniforms: t_shooters copied into a buffer on the GPU.
#include "shooting/shooter.glsl"

layout(std140) uniform ShooterBlock {
    vec4 u_shooter_rows[SHOOTER_ROWS];
};

Shooter this_shooter() { return shooter_from_rows(u_shooter_rows); }
