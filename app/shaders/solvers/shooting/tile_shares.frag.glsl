// What the texels of a tile receive of each shot of a batch: Σ A F V, four shots in each target.
#include "common/tile.glsl"

uniform sampler2D t_position_area;
uniform sampler2D t_first;
uniform sampler2D t_last;

layout(location = 0) out vec4 out_first;
layout(location = 1) out vec4 out_last;

void main() {
    ivec2 corner_px = ivec2(gl_FragCoord.xy) * TILE;
    out_first = out_last = vec4(0.0);
    for (int k = 0; k < TILE * TILE; ++k) {
        ivec2 px = corner_px + ivec2(k % TILE, k / TILE);
        float area = texelFetch(t_position_area, px, 0).w;
        out_first += area * texelFetch(t_first, px, 0);
        out_last += area * texelFetch(t_last, px, 0);
    }
}
