// What gather points receive, smoothed over those of the same chart around them: of four neighbours, which look along different
// directions, each counts for a quarter, see ray_of_point.glsl. Two that lie across from each other are taken together, or not at
// all: at the edge of a chart, where light changes towards another one, the mean of one side would be off. What differs twofold is
// no noise of the rays, but a shadow.
#include "solvers/shooting/block.glsl"
#include "solvers/shooting/block_at.glsl"

uniform sampler2D t_gathered;  // see gather_ambient.frag.glsl

layout(location = 0) out vec4 out_ambient;  // a: as there

const ivec2 ASIDE[4] = ivec2[](ivec2(1, 0), ivec2(0, 1), ivec2(1, 1), ivec2(1, -1));

float strength(vec4 point) { return dot(abs(point.rgb), vec3(1.0)); }

void main() {
    ivec2 block = ivec2(gl_FragCoord.xy), slot = block * BLOCK / TILE, inside = block - slot * (TILE / BLOCK);
    vec4 middle = texelFetch(t_gathered, block, 0);
    out_ambient = middle;
    if (middle.a == 0.0) return;
    vec4 sum = 4.0 * vec4(middle.rgb, 1.0);
    for (int i = 0; i < 4; ++i) {
        ivec2 one = block_at(inside + ASIDE[i], slot), other = block_at(inside - ASIDE[i], slot);
        vec4 there = texelFetch(t_gathered, max(one, 0), 0), across = texelFetch(t_gathered, max(other, 0), 0);
        float least = min(strength(there), strength(across)), most = max(strength(there), strength(across));
        bool both = one.y >= 0 && other.y >= 0 && there.a == middle.a && across.a == middle.a;
        both = both && 2.0 * least >= strength(middle) && most <= 2.0 * strength(middle);
        if (both) sum += (i < 2 ? 2.0 : 1.0) * vec4(there.rgb + across.rgb, 2.0);
    }
    out_ambient.rgb = sum.rgb / sum.a;
}
