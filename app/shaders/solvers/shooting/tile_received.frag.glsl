// What the texels of one tile have received is Σ H A.
#include "common/atlas.glsl"
#include "common/tile.glsl"

uniform sampler2D t_position_area;
uniform sampler2D t_irradiance;

layout(location = 0) out vec4 out_received;

void main() {
    ivec2 corner_px = ivec2(gl_FragCoord.xy) * TILE;
    out_received = vec4(0.0);
    for (int k = 0; k < TILE * TILE; ++k) {
        ivec2 px = corner_px + ivec2(k % TILE, k / TILE);
        float area = texelFetch(t_position_area, px, 0).w;
        if (area > 0.0) out_received.rgb += texelFetch(t_irradiance, px, 0).rgb * area;
    }
}
