// The power that a tile would receive from a batch is Σ A a: receive.frag.glsl leaves Σ r F V of all its shots in a.
#include "common/tile.glsl"

uniform sampler2D t_position_area;
uniform sampler2D t_received;

layout(location = 0) out float out_power;

void main() {
    ivec2 corner_px = ivec2(gl_FragCoord.xy) * TILE;
    out_power = 0.0;
    for (int k = 0; k < TILE * TILE; ++k) {
        ivec2 px = corner_px + ivec2(k % TILE, k / TILE);
        out_power += texelFetch(t_position_area, px, 0).w * texelFetch(t_received, px, 0).a;
    }
}
