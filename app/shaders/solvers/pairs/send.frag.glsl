// What each sender sends: B = E + ρH, the mean over the texels that it stands for, by area. a: how many texels these are.
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "common/exitance.glsl"
#include "solvers/pairs/rows.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_received;  // H of the last pass [stored units]
uniform sampler2D t_texels;    // column and row of each texel in the tile pool
uniform sampler2D t_ranges;    // of each sender: first texel, and how many
uniform int u_senders;
uniform float u_unit;          // W/m² per stored unit

layout(location = 0) out vec4 out_sent;

void main() {
    int sender = entry_at(gl_FragCoord.xy);
    out_sent = vec4(0.0);
    if (sender >= u_senders) return;
    vec2 range = texelFetch(t_ranges, row_px(sender), 0).xy;
    vec4 sum = vec4(0.0);
    for (int k = int(range.x); k < int(range.x) + int(range.y); ++k) {
        ivec2 px = ivec2(texelFetch(t_texels, row_px(k), 0).xy);
        float A = texelFetch(t_position_area, px, 0).w;
        uint material = material_from_ids(texelFetch(t_normal_ids, px, 0).y);
        vec3 rho = albedo_of(t_materials, material, px), H = texelFetch(t_received, px, 0).rgb;
        sum += A * vec4(exitance_of(t_materials, material, px) / u_unit + rho * H, 1.0);
    }
    out_sent = vec4(sum.rgb / sum.w, range.y);
}
