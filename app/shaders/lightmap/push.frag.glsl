// The light of a leaf onto its children: interpolated, then brought back to the mean of the texel that four of them replace.
// Their areas sum to its area, so that pushing keeps all energy. [Coombe03, 4.2]
uniform sampler2D t_position_area;
uniform sampler2D t_lifted_irradiance;
uniform sampler2D t_lifted_residual;
uniform sampler2D t_lifted_area;

flat in vec2 v_corner;
flat in vec2 v_from;

layout(location = 0) out vec4 out_irradiance;
layout(location = 1) out vec4 out_residual;

const int TILE = 16;
const ivec2 QUARTERS[4] = ivec2[](ivec2(0, 0), ivec2(1, 0), ivec2(0, 1), ivec2(1, 1));

// H, r of the lifted leaf at one quarter of its texel: bilinear, among texels of its tile that cover something
void interpolated(ivec2 px, ivec2 quarter, out vec4 H, out vec4 r) {
    ivec2 lower = px / TILE * TILE, upper = lower + TILE - 1;
    H = r = vec4(0.0);
    float sum = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 step = QUARTERS[k] * (2 * quarter - 1);
        ivec2 at = clamp(px + step, lower, upper);
        float weight = (QUARTERS[k].x == 0 ? 3.0 : 1.0) * (QUARTERS[k].y == 0 ? 3.0 : 1.0);
        weight *= texelFetch(t_lifted_area, at, 0).r > 0.0 ? 1.0 : 0.0;
        H += weight * texelFetch(t_lifted_irradiance, at, 0);
        r += weight * texelFetch(t_lifted_residual, at, 0);
        sum += weight;
    }
    H /= max(sum, 1e-30);
    r /= max(sum, 1e-30);
}

void main() {
    ivec2 inside = ivec2(gl_FragCoord.xy - v_corner), block = inside / 2;
    ivec2 px = ivec2(v_from) + block, first = ivec2(v_corner) + 2 * block;
    vec4 mean_H = vec4(0.0), mean_r = vec4(0.0), H, r;
    float area = 0.0;
    for (int k = 0; k < 4; ++k) {
        float own = texelFetch(t_position_area, first + QUARTERS[k], 0).w;
        interpolated(px, QUARTERS[k], H, r);
        mean_H += own * H;
        mean_r += own * r;
        area += own;
    }
    interpolated(px, inside - 2 * block, H, r);
    vec4 before_H = texelFetch(t_lifted_irradiance, px, 0), before_r = texelFetch(t_lifted_residual, px, 0);
    // H by a factor, so that it stays positive; r, which may have either sign, by a difference
    vec4 scale = before_H * area / max(mean_H, 1e-30);
    out_irradiance = H * mix(vec4(0.0), scale, greaterThan(mean_H, vec4(0.0)));
    out_residual = r + before_r - mean_r / max(area, 1e-37);
}
