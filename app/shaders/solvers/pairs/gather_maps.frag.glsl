// What texels receive from some senders, by what these see: a visibility map each, above each other. See gather.frag.glsl; merged
// texels come with area 0.
#include "solvers/pairs/sender.glsl"
#include "common/hemisphere.glsl"
#include <projection>
#include "visibility/visible.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_sent;  // B of each sender [stored units]
uniform ivec2 u_range;     // the first sender, and how many

layout(location = 0) out vec4 out_received;

void main() {
    Texel texel = load_texel(t_position_area, t_normal_ids, ivec2(gl_FragCoord.xy));
    out_received = vec4(0.0);
    if (texel.area <= 0.0) return;
    for (int k = 0; k < u_range.y; ++k) {
        Sender s = load_sender(u_range.x + k);
        float F = form_factor(texel.position, texel.normal, s);
        if (F <= 0.0) continue;
        mat3 axes = frame_of(s.normal);
        float V = visible(float(texel.facet), texel.position, (texel.position - s.position) * axes, texel.normal * axes, axes, k);
        out_received += F * V * vec4(texelFetch(t_sent, row_px(u_range.x + k), 0).rgb, 1.0);
    }
}
