// Adds to the ledger what texels have received, or takes it away: before and after a batch of directions, that is what these sent
// out. Blended.
#include "solvers/shooting/ledger.glsl"

uniform sampler2D t_received;  // of each tile
uniform float u_sign;
uniform float u_shots;

layout(location = 0) out vec4 out_ledger;

void main() {
    ivec2 size = textureSize(t_received, 0);
    vec3 sum = vec3(0.0);
    for (int y = 0; y < size.y; ++y) {
        vec3 row = vec3(0.0);
        for (int x = 0; x < size.x; ++x) row += texelFetch(t_received, ivec2(x, y), 0).rgb;
        sum += row;
    }
    vec3 none = vec3(0.0);
    out_ledger = ledger_row(Ledger(none, u_shots, none, none, u_sign * sum), int(gl_FragCoord.y));
}
