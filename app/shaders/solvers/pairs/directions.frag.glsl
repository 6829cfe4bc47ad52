// What texels receive along some of the directions, the same around each normal: the mean of B of what rays meet first, and in a
// how many meet a texel. The directions lie as the cosine: none is weighted. Blended. [Kahl22]
#include "common/hemisphere.glsl"
#include "common/item.glsl"
#include "common/texel_at.glsl"
#include "solvers/pairs/rows.glsl"
#include "visibility/rays.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform usampler2D t_number;
uniform sampler2D t_sent;
uniform ivec2 u_range;  // the first direction, and how many
uniform int u_directions;

const float GOLDEN = 0.61803398875;

layout(location = 0) out vec4 out_received;

void main() {
    Texel texel = load_texel(t_position_area, t_normal_ids, ivec2(gl_FragCoord.xy));
    out_received = vec4(0.0);
    if (texel.area <= 0.0) return;
    vec3 from = texel.position + 2.0 * COPLANAR * texel.normal;
    for (int k = u_range.x; k < u_range.x + u_range.y; ++k) {
        // a spiral of Fibonacci on the disc [Vogel79]
        vec2 share = vec2((float(k) + 0.5) / float(u_directions), fract(float(k) * GOLDEN));
        Hit hit = closest_hit(from, cosine_direction(texel.normal, share), 0.0, 2.0 * FAR);
        if (hit.slot < 0) continue;
        vec2 place = place_of(hit);
        ivec2 there = place.x < 0.0 ? ivec2(-1) : texel_px_at(place);
        int j = there.y < 0 ? -1 : int(texelFetch(t_number, there, 0).x) - 1;
        if (j >= 0) out_received += vec4(texelFetch(t_sent, row_px(j), 0).rgb, 1.0);
    }
    out_received /= float(u_directions);
}
