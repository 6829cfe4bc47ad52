// Adds to the ledger what directions have sent to sides with texels, by what their maps show of these. Blended.
#include "solvers/shooting/shooter.glsl"
#include "solvers/shooting/ledger.glsl"

uniform sampler2D t_sent;  // samples, of the blocks of each map
uniform sampler2D t_shooters;
uniform int u_blocks;    // rows of t_sent per shot
uniform float u_sample;  // area of a sample, solver space

layout(location = 0) out vec4 out_ledger;

void main() {
    int shot = int(gl_FragCoord.x), row = int(gl_FragCoord.y);
    float samples = 0.0;
    for (int y = shot * u_blocks; row == LEDGER_ROWS - 1 && y < (shot + 1) * u_blocks; ++y)
        for (int x = 0; x < textureSize(t_sent, 0).x; ++x) samples += texelFetch(t_sent, ivec2(x, y), 0).r;
    vec3 none = vec3(0.0), power = load_shooter(t_shooters, shot).exitance * samples * u_sample;
    out_ledger = ledger_row(Ledger(none, 1.0, none, none, power), row);
}
