// The light that is shown: H = direct + indirect. Texels that are finer than points interpolate among those of their chart.
#define FINER 0
#include "common/atlas.glsl"
#include "common/texel_at.glsl"

uniform sampler2D t_direct;    // a: variance of the mean of RGB
uniform sampler2D t_indirect;  // of points; a: variance of the mean of RGB
#if FINER
uniform sampler2D t_own_leaves;
uniform usampler2D t_own_normal;  // and the chart
uniform usampler2D t_origin_normal;
#endif

layout(location = 0) out vec4 out_irradiance;  // a: direct light, the mean of RGB
layout(location = 1) out float out_variance;   // of the mean of RGB

#if FINER
vec4 indirect_at(ivec2 px) {
    vec3 leaf = texelFetch(t_own_leaves, px / TILE, 0).xyz;
    vec2 uv = (leaf.xy * float(TILE) + vec2(px % TILE) + 0.5) * leaf.z, low = floor(uv - 0.5), share = uv - 0.5 - low;
    uint chart = texelFetch(t_own_normal, px, 0).y;
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    for (int i = 0; i < 4; ++i) {
        vec2 corner = vec2(i & 1, i >> 1), weight = mix(1.0 - share, share, corner);
        ivec2 point_px = texel_px_at(low + corner + 0.5);
        if (point_px.y < 0 || texelFetch(t_origin_normal, point_px, 0).y != chart) continue;
        sum += weight.x * weight.y * texelFetch(t_indirect, point_px, 0);
        weights += weight.x * weight.y;
    }
    return sum / max(weights, 1e-6);
}
#else
vec4 indirect_at(ivec2 px) { return texelFetch(t_indirect, px, 0); }
#endif

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    vec4 direct = texelFetch(t_direct, px, 0), indirect = indirect_at(px);
    out_irradiance = vec4(direct.rgb + indirect.rgb, dot(direct.rgb, vec3(1.0 / 3.0)));
    out_variance = direct.a + indirect.a;
}
