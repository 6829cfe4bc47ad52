// Adds a batch to the ledger: of each shot the power that left the scene, what black sides took, and all that it shot (RGB).
// Blended.
#include "solvers/shooting/shooter.glsl"
#include "solvers/shooting/ledger.glsl"

uniform sampler2D t_escaped;
uniform sampler2D t_shooters;
uniform int u_blocks;  // rows of t_escaped per shot

layout(location = 0) out vec4 out_ledger;

void main() {
    int shot = int(gl_FragCoord.x), row = int(gl_FragCoord.y);
    Shooter s = load_shooter(t_shooters, shot);
    vec2 share = vec2(0.0);
    for (int y = shot * u_blocks; row < 2 && y < (shot + 1) * u_blocks; ++y)
        for (int x = 0; x < textureSize(t_escaped, 0).x; ++x) share += texelFetch(t_escaped, ivec2(x, y), 0).rg;
    vec3 power = s.exitance * s.area;
    out_ledger = size_px(s) == 0 ? vec4(0.0) : ledger_row(Ledger(power * share.r, 1.0, power * share.g, power, vec3(0.0)), row);
}
