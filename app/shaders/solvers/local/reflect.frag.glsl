// The direct light that each texel reflects, B = ρ H_direct, in order.
#include "common/atlas.glsl"
#include "common/albedo.glsl"

uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform usampler2D t_order;  // y << 16 | x of each texel in order, folded
uniform sampler2D t_direct;

layout(location = 0) out vec4 out_emitted;

void main() {
    uint at = texelFetch(t_order, ivec2(gl_FragCoord.xy), 0).x;
    ivec2 px = ivec2(at & 0xFFFFu, at >> 16);
    uint material = material_from_ids(texelFetch(t_normal_ids, px, 0).y);
    out_emitted = vec4(albedo_of(t_materials, material, px) * texelFetch(t_direct, px, 0).rgb, 1.0);
}
