// What is left to do in a tile, one texel per slot: (Σ σ A, Σ H A, Σ D/σ A), of the mean of RGB, with D the variance of direct light.
#include "common/tile.glsl"

uniform sampler2D t_position_area;
uniform sampler2D t_irradiance;
uniform sampler2D t_variance;
uniform sampler2D t_direct;  // a: variance

layout(location = 0) out vec4 out_noise;

void main() {
    ivec2 corner_px = ivec2(gl_FragCoord.xy) * TILE;
    out_noise = vec4(0.0);
    for (int i = 0; i < TILE * TILE; ++i) {
        ivec2 px = corner_px + ivec2(i % TILE, i / TILE);
        float A = texelFetch(t_position_area, px, 0).w, H = dot(texelFetch(t_irradiance, px, 0).rgb, vec3(1.0 / 3.0));
        float deviation = sqrt(texelFetch(t_variance, px, 0).r);
        out_noise.rgb += A * vec3(deviation, H, texelFetch(t_direct, px, 0).a / max(deviation, 1e-30));
    }
}
