// The indirect light of every point, smoothed by as much as it is noisy.
//
// The mean over a window of points of the same chart that face the same way, the largest whose interval of confidence still meets
// those of all smaller ones [Goldenshluger97; Katkovnik99]: where light bends by more than its noise, the window ends.
#define SMOOTH 1
#include "common/atlas.glsl"
#include "common/texel_at.glsl"

uniform sampler2D t_gathered;  // see gather.frag.glsl
uniform usampler2D t_origin_normal;  // and the chart
uniform float u_rays;

layout(location = 0) out vec4 out_indirect;  // a: variance of the mean of RGB

const uint NO_CHART = 0xFFFFFFFFu;
const float GROUP = 8.0;       // rays, see gather.frag.glsl
const float CONFIDENCE = 1.0;  // standard deviations
const float COS_ALIKE = 0.94;  // 20°
const int WINDOWS = 4;
const int RADII[WINDOWS] = int[](0, 1, 2, 4);

// Mean of RGB and its variance.
float variance_of(vec4 g) {
    float groups = u_rays / GROUP, mean = dot(g.rgb, vec3(1.0 / 3.0)) / u_rays;
    return max(g.a / (GROUP * GROUP * groups) - mean * mean, 0.0) / max(groups - 1.0, 1.0);
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    vec4 own = texelFetch(t_gathered, px, 0);
    out_indirect = vec4(own.rgb / u_rays, variance_of(own));
#if SMOOTH
    uvec2 mine = texelFetch(t_origin_normal, px, 0).xy;
    if (mine.y != NO_CHART) {
        vec3 normal = normal_from_octahedral(mine.x), leaf = texelFetch(t_leaves, px / TILE, 0).xyz;
        ivec2 inside = px % TILE;
        vec2 uv = (leaf.xy * float(TILE) + vec2(inside) + 0.5) * leaf.z;
        vec4 sum = vec4(0.0);  // Σ RGB, Σ variance
        float count = 0.0, low = -1e30, high = 1e30;
        int done = -1;
        for (int w = 0; w < WINDOWS; ++w) {
            int radius = RADII[w];
            for (int j = -radius; j <= radius; ++j)
                for (int i = -radius; i <= radius; ++i) {
                    if (max(abs(i), abs(j)) <= done) continue;
                    ivec2 at = inside + ivec2(i, j), there = px + ivec2(i, j);
                    if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, ivec2(TILE))))
                        there = texel_px_at(uv + vec2(i, j) * leaf.z);
                    if (there.y < 0) continue;
                    uvec2 other = texelFetch(t_origin_normal, there, 0).xy;
                    if (other.y != mine.y || dot(normal_from_octahedral(other.x), normal) < COS_ALIKE) continue;
                    vec4 g = texelFetch(t_gathered, there, 0);
                    sum += vec4(g.rgb / u_rays, variance_of(g));
                    count += 1.0;
                }
            done = radius;
            // the variance of all texels in the window is alike: its mean is far less noisy than that of each
            float mean = dot(sum.rgb, vec3(1.0 / 3.0)) / count, deviation = sqrt(sum.a) / count;
            low = max(low, mean - CONFIDENCE * deviation);
            high = min(high, mean + CONFIDENCE * deviation);
            if (low > high) break;
            out_indirect = vec4(sum.rgb / count, sum.a / (count * count));
        }
    }
#endif
}
