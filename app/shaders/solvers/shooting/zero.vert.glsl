// Covers the patches of all shooters of the batch: one quad per instance.
#include "solvers/shooting/shooter.glsl"

uniform sampler2D t_shooters;
uniform vec2 u_size;  // of the tile pool [texels]

flat out int v_shot;

void main() {
    v_shot = gl_InstanceID;
    Shooter s = load_shooter(t_shooters, v_shot);
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    vec2 px = vec2(patch_px(s)) + corner * float(size_px(s));
    gl_Position = vec4(px / u_size * 2.0 - 1.0, 0.0, 1.0);
}
