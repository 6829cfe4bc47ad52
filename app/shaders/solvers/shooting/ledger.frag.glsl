// Adds a batch to the ledger: of each shot the power that left the scene, what black sides took, and all that it shot (RGB).
// Blended.
#include "solvers/shooting/shooter.glsl"
#include "solvers/shooting/ledger.glsl"

uniform sampler2D t_shooters;

layout(location = 0) out vec4 out_ledger;

void main() {
    int shot = int(gl_FragCoord.x), row = int(gl_FragCoord.y);
    Shooter s = load_shooter(t_shooters, shot);
    vec3 power = s.exitance * s.area;
    out_ledger = size_px(s) == 0 ? vec4(0.0) : ledger_row(Ledger(power * s.open, 1.0, power * s.black, power), row);
}
