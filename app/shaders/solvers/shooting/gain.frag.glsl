// What became of each shot of a batch, as shares of its power: open of what left the scene, black of what ended on sides without
// texels; and the gain that makes it give away what it owns:
//
//   gain · received + open + black = 1,   received = Σ_j A_j F_ji V_ji / A_i
//
// Written into the last row of the shooters.
#include "solvers/shooting/shooter_block.glsl"
#define SCALED 1     // whether there are other gains than 1
#define SOUND 0.01   // the map is off by no more, nor by more than it says is gone
#define MOST 2.0     // gain at most

uniform sampler2D t_first;  // Σ A F V of each row of tiles
uniform sampler2D t_last;
uniform sampler2D t_escaped;
uniform int u_rows;    // of tiles
uniform int u_blocks;  // rows of t_escaped per shot

layout(location = 0) out vec4 out_row;

void main() {
    int shot = int(gl_FragCoord.y);
    Shooter s = shooter_of(shot);
    s.gain = 1.0;
    s.open = s.black = s.received = 0.0;
    if (size_px(s) > 0) {
        for (int y = shot * u_blocks; y < (shot + 1) * u_blocks; ++y)
            for (int x = 0; x < textureSize(t_escaped, 0).x; ++x) {
                vec2 share = texelFetch(t_escaped, ivec2(x, y), 0).rg;
                s.open += share.r;
                s.black += share.g;
            }
        for (int y = 0; y < u_rows; ++y)
            s.received += (shot < 4 ? texelFetch(t_first, ivec2(0, y), 0) : texelFetch(t_last, ivec2(0, y), 0))[shot & 3];
        s.received /= s.area;
        float due = max(1.0 - s.open - s.black, 0.0);
        bool sound = abs(s.received - due) <= min(SOUND, s.open + s.black);
        if (SCALED == 1 && !sound) s.gain = min(due / max(s.received, 1e-30), MOST);
    }
    out_row = shooter_row(s, SHOOTER_ROWS - 1);
}
