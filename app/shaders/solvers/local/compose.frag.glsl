// The light that is shown, H = direct + indirect, and how much of what was shown stays. Blended. The indirect light of patches of
// many texels, and of clusters, is smoothed over one of them, which interpolates it: within a chart.
#include "common/atlas.glsl"
#include "common/texel_at.glsl"
#include "direct_light/folded.glsl"
#include "solvers/local/node.glsl"
#include "solvers/local/place.glsl"

uniform usampler2D t_origin_normal;  // and the chart
uniform sampler2D t_direct;
uniform usampler2D t_places;  // of each texel in order
uniform usampler2D t_slots;   // of each texel in order, from 1, folded
uniform sampler2D t_indirect;
uniform sampler2D t_outside;
uniform float u_stays;

layout(location = 0) out vec4 out_irradiance;

const int MOST_STEPS = 4;

int slot_of(ivec2 px) {
    uint place = texelFetch(t_places, px, 0).x;
    return place == LOST ? -1 : int(texelFetch(t_slots, folded(int(place)), 0).x) - 1;
}

vec3 light_of(int slot) { return slot < 0 ? texelFetch(t_outside, ivec2(0), 0).rgb : texelFetch(t_indirect, at_slot(slot), 0).rgb; }

vec3 indirect_at(ivec2 px) {
    int own = slot_of(px);
    float edge = own < 0 ? 1.0 : texelFetch(t_nodes, at_slot(own, 1), 0).w;
    if (edge <= 1.0) return light_of(own);
    vec3 leaf = texelFetch(t_leaves, px / TILE, 0).xyz;
    vec2 middle = (leaf.xy * float(TILE) + vec2(px % TILE) + 0.5) * leaf.z;
    uint chart = texelFetch(t_origin_normal, px, 0).y;
    bool patch_of_texels = texelFetch(t_nodes, at_slot(own, 2), 0).x < 0.5;
    int steps = patch_of_texels ? min(int(edge), MOST_STEPS) : 2;
    vec3 sum = vec3(0.0);
    float count = 0.0;
    for (int n = 0; n < steps * steps; ++n) {
        vec2 way = ((vec2(n % steps, n / steps) + 0.5) / float(steps) - 0.5) * edge;
        ivec2 at = texel_px_at(middle + way);
        if (at.y < 0 || texelFetch(t_origin_normal, at, 0).y != chart) continue;
        sum += light_of(slot_of(at));
        count += 1.0;
    }
    return count > 0.0 ? sum / count : light_of(own);
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    out_irradiance = vec4(0.0);
    if (texelFetch(t_places, px, 0).x == LOST) return;
    vec3 indirect = indirect_at(px);
    if (!any(isnan(indirect))) indirect = max(indirect, 0.0);  // what is no number must be seen
    vec3 H = texelFetch(t_direct, px, 0).rgb + indirect;
    out_irradiance = vec4((1.0 - u_stays) * H, u_stays);
}
