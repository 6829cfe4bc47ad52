// The light of children is pulled up to the leaf that replaces them: means over area of H and of what they keep, which keep all
// energy.
#include "common/atlas.glsl"
#include "lightmap/kept.glsl"

uniform sampler2D t_lifted_irradiance;
uniform sampler2D t_lifted_kept;
uniform sampler2D t_lifted_area;

flat in vec2 v_corner;
flat in vec2 v_from;

layout(location = 0) out vec4 out_irradiance;
layout(location = 1) out vec4 out_residual;

void main() {
    ivec2 first = ivec2(v_from + 2.0 * floor(gl_FragCoord.xy - v_corner));
    vec4 H = vec4(0.0), kept = vec4(0.0);
    float area = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 px = first + ivec2(k & 1, k >> 1);
        float own = texelFetch(t_lifted_area, px, 0).r;
        H += own * texelFetch(t_lifted_irradiance, px, 0);
        kept += own * texelFetch(t_lifted_kept, px, 0);
        area += own;
    }
    out_irradiance = H / max(area, 1e-37);
    vec4 r = residual_from_kept(ivec2(gl_FragCoord.xy), out_irradiance.rgb, kept / max(area, 1e-37));
    out_residual = area > 0.0 ? r : vec4(0.0);
}
