// The light of a leaf is pushed down to its children [Coombe03, 4.2]. H is interpolated, then brought back to the mean of the
// texel that four of them replace; their areas sum to its area, so that pushing keeps all energy. What a texel has shot, R, it
// has shot all over: its children keep that and r = E + ρH - R, or a patch that has shot would shoot again what its neighbours
// have not.
#include "common/atlas.glsl"
#include "common/tile.glsl"
#include "lightmap/kept.glsl"

uniform sampler2D t_position_area;
uniform sampler2D t_lifted_irradiance;
uniform sampler2D t_lifted_kept;
uniform sampler2D t_lifted_area;

flat in vec2 v_corner;
flat in vec2 v_from;

layout(location = 0) out vec4 out_irradiance;
layout(location = 1) out vec4 out_residual;

const ivec2 QUARTERS[4] = ivec2[](ivec2(0, 0), ivec2(1, 0), ivec2(0, 1), ivec2(1, 1));

// H of the lifted leaf at one quarter of its texel: bilinear, among texels of its tile that cover something
vec4 interpolated(ivec2 px, ivec2 quarter) {
    ivec2 lower = px / TILE * TILE, upper = lower + TILE - 1;
    vec4 H = vec4(0.0);
    float sum = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 step = QUARTERS[k] * (2 * quarter - 1);
        ivec2 at = clamp(px + step, lower, upper);
        float weight = (QUARTERS[k].x == 0 ? 3.0 : 1.0) * (QUARTERS[k].y == 0 ? 3.0 : 1.0);
        weight *= texelFetch(t_lifted_area, at, 0).r > 0.0 ? 1.0 : 0.0;
        H += weight * texelFetch(t_lifted_irradiance, at, 0);
        sum += weight;
    }
    return H / max(sum, 1e-30);
}

void main() {
    ivec2 inside = ivec2(gl_FragCoord.xy - v_corner), block = inside / 2;
    ivec2 px = ivec2(v_from) + block, first = ivec2(v_corner) + 2 * block;
    vec4 mean_H = vec4(0.0);
    float area = 0.0;
    for (int k = 0; k < 4; ++k) {
        float own = texelFetch(t_position_area, first + QUARTERS[k], 0).w;
        mean_H += own * interpolated(px, QUARTERS[k]);
        area += own;
    }
    // by a factor, so that it stays positive
    vec4 scale = texelFetch(t_lifted_irradiance, px, 0) * area / max(mean_H, 1e-30);
    out_irradiance = interpolated(px, inside - 2 * block) * mix(vec4(0.0), scale, greaterThan(mean_H, vec4(0.0)));
    ivec2 own_px = ivec2(gl_FragCoord.xy);
    bool covered = texelFetch(t_position_area, own_px, 0).w > 0.0;
    vec4 kept = texelFetch(t_lifted_kept, px, 0);
    out_residual = covered ? residual_from_kept(own_px, out_irradiance.rgb, kept) : vec4(0.0);
}
