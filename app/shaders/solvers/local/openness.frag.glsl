// How open a texel is: the share of its rays that leave the scene, or hit a side without texels.
#include "visibility/origin.glsl"
#include "visibility/rays.glsl"
#define RAYS

uniform usampler2D t_starts;  // y << 16 | x of texels

layout(location = 0) out float out_open;

void main() {
    uint start = texelFetch(t_starts, ivec2(gl_FragCoord.xy), 0).x;
    Origin o = load_origin(ivec2(start & 0xFFFFu, start >> 16));
    int lost = 0;
    for (int k = 0; k < RAYS; ++k) {
        vec3 from, direction;
        kth_ray(o, k, from, direction);
        Hit hit = closest_hit(from, direction, 0.0, 2.0 * FAR);
        lost += int(hit.slot < 0 || place_of(hit).x < 0.0);
    }
    out_open = float(lost) / float(RAYS);
}
