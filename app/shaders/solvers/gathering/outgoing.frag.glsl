// What rays find on every point: the light that it sends on, B = ρH. That of lamps is found by shadow rays.
#include "common/atlas.glsl"
#include "common/albedo.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_solution;

layout(location = 0) out vec4 out_outgoing;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    out_outgoing = vec4(0.0);
    if (texelFetch(t_position_area, px, 0).w <= 0.0) return;
    uint material = material_from_ids(texelFetch(t_normal_ids, px, 0).y);
    out_outgoing.rgb = albedo_of(t_materials, material, px) * texelFetch(t_solution, px, 0).rgb;
}
