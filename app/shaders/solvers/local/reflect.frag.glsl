// The direct light that each node sends on, e = mean of ρ H_direct over some of its texels.
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "direct_light/folded.glsl"
#include "solvers/local/node.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform usampler2D t_order;  // y << 16 | x of each texel in order, folded
uniform sampler2D t_direct;

layout(location = 0) out vec4 out_reflected;

const int MOST = 64;  // texels

void main() {
    Node node = load_node(slot_at(ivec2(gl_FragCoord.xy)));
    out_reflected = vec4(0.0);
    if (node.area <= 0.0) return;
    int length = node.count, count = min(length, MOST);
    vec4 sum = vec4(0.0);
    for (int n = 0; n < count; ++n) {
        // in floats: products would be beyond 32 bits
        int nth = node.start + min(int((float(n) + 0.5) * (float(length) / float(count))), length - 1);
        uint at = texelFetch(t_order, folded(nth), 0).x;
        ivec2 px = ivec2(at & 0xFFFFu, at >> 16);
        float area = texelFetch(t_position_area, px, 0).w;
        uint material = material_from_ids(texelFetch(t_normal_ids, px, 0).y);
        sum += area * vec4(albedo_of(t_materials, material, px) * texelFetch(t_direct, px, 0).rgb, 1.0);
    }
    out_reflected = vec4(sum.rgb / max(sum.a, 1e-30), 1.0);
}
