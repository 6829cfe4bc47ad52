// Adds a batch to the ledger, one column per shot of it: row 0 the power that left the scene, row 1 what black sides took, row 2
// all that it shot (RGB).
// Blended.
#include "solvers/shooting/shooter.glsl"

uniform sampler2D t_open;
uniform sampler2D t_shooters;
uniform int u_blocks;  // rows of t_open per shot

layout(location = 0) out vec4 out_ledger;

void main() {
    int shot = int(gl_FragCoord.x);
    Shooter s = load_shooter(t_shooters, shot);
    int row = int(gl_FragCoord.y);
    vec2 share = vec2(0.0);
    for (int y = shot * u_blocks; row < 2 && y < (shot + 1) * u_blocks; ++y)
        for (int x = 0; x < textureSize(t_open, 0).x; ++x) share += texelFetch(t_open, ivec2(x, y), 0).rg;
    float taken = row == 0 ? share.r : row == 1 ? share.g : 1.0;
    out_ledger = s.size_px == 0 ? vec4(0.0) : vec4(s.exitance * s.area * taken, 1.0);
}
