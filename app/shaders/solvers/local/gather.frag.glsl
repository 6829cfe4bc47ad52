// What the rays of each node bring from the texels of the set that they hit, its first bounce; what they find where they start, the
// mean over the node; and how much of that they carry to the set.
#include "direct_light/folded.glsl"
#include "solvers/local/node.glsl"
#include "solvers/local/place.glsl"

uniform sampler2D t_emitted;  // of each texel in order, folded
uniform usampler2D t_slots;  // of each texel in order, from 1, folded
uniform usampler2D t_ends;  // a row for each slot: places in the order of the texels where each ray starts and ends

layout(location = 0) out vec4 out_reflected;
layout(location = 1) out vec4 out_first;
layout(location = 2) out vec4 out_carried;

void main() {
    int slot = slot_at(ivec2(gl_FragCoord.xy));
    out_reflected = out_first = out_carried = vec4(0.0);
    if (load_node(slot).area <= 0.0) return;
    int rays = textureSize(t_ends, 0).x;
    vec3 reflected = vec3(0.0), first = vec3(0.0), carried = vec3(0.0);
    for (int k = 0; k < rays; ++k) {
        uvec2 ends = texelFetch(t_ends, ivec2(k, slot), 0).xy;
        vec3 start = texelFetch(t_emitted, folded(int(ends.x)), 0).rgb;
        reflected += start;
        ivec2 hit = folded(int(ends.y));
        if (ends.y == LOST || texelFetch(t_slots, hit, 0).x == 0u) continue;
        first += texelFetch(t_emitted, hit, 0).rgb;
        carried += start;
    }
    out_reflected = vec4(reflected / float(rays), 1.0);
    out_first = vec4(first / float(rays), 1.0);
    out_carried = vec4(carried / float(rays), 1.0);
}
