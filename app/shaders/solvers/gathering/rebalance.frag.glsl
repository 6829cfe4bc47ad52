// Sums over a tile, one texel per slot: Σ A direct, and Σ A (H - Σ B / N), what bounces do not bring, RGB, stored units.
#include "common/tile.glsl"

uniform sampler2D t_position_area;
uniform sampler2D t_direct;
uniform sampler2D t_gathered;
uniform sampler2D t_solution;
uniform float u_rays;

layout(location = 0) out vec4 out_direct;
layout(location = 1) out vec4 out_missing;

void main() {
    ivec2 corner_px = ivec2(gl_FragCoord.xy) * TILE;
    out_direct = out_missing = vec4(0.0);
    for (int i = 0; i < TILE * TILE; ++i) {
        ivec2 px = corner_px + ivec2(i % TILE, i / TILE);
        float A = texelFetch(t_position_area, px, 0).w;
        vec3 bounced = texelFetch(t_gathered, px, 0).rgb / u_rays;
        out_direct.rgb += A * texelFetch(t_direct, px, 0).rgb;
        out_missing.rgb += A * (texelFetch(t_solution, px, 0).rgb - bounced);
    }
}
