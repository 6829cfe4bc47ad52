// What gather points receive, smoothed over those of the same chart around them: of four neighbours, which look along different
// directions, each counts for a quarter. See ray_of_point.glsl.
#include "solvers/shooting/block.glsl"
#include "solvers/shooting/block_at.glsl"

uniform sampler2D t_gathered;  // see gather_ambient.frag.glsl

layout(location = 0) out vec4 out_ambient;  // a: as there

void main() {
    ivec2 block = ivec2(gl_FragCoord.xy), slot = block * BLOCK / TILE;
    float chart = texelFetch(t_gathered, block, 0).a;
    out_ambient = vec4(0.0);
    if (chart == 0.0) return;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 9; ++i) {
        ivec2 aside = ivec2(i % 3, i / 3) - 1, other = block_at(block + aside - slot * (TILE / BLOCK), slot);
        vec4 one = texelFetch(t_gathered, max(other, 0), 0);
        ivec2 share = 2 - abs(aside);
        if (other.y >= 0 && one.a == chart) sum += float(share.x * share.y) * vec4(one.rgb, 1.0);
    }
    out_ambient = vec4(sum.rgb / sum.a, chart);
}
