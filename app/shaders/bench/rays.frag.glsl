// A ray a texel, given by its origin and direction: what it meets.
#define ANY 0  // whether it only matters if it meets anything
#include "visibility/rays.glsl"

uniform sampler2D t_origins;     // a: nearest
uniform sampler2D t_directions;  // a: farthest

layout(location = 0) out vec4 out_hit;    // distance, triangle in the scene or -1, weights; ANY: 1 or 0
layout(location = 1) out vec4 out_place;  // in the virtual atlas [texels of level 0]; 1: from the front

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    vec4 origin = texelFetch(t_origins, px, 0), direction = texelFetch(t_directions, px, 0);
    out_place = vec4(0.0);
#if ANY
    out_hit = vec4(any_hit(origin.xyz, direction.xyz, origin.w, direction.w));
#else
    Hit hit = closest_hit(origin.xyz, direction.xyz, origin.w, direction.w);
    out_hit = vec4(hit.distance, hit.slot < 0 ? -1.0 : float(triangle_of(hit)), hit.weights);
    if (hit.slot >= 0) out_place = vec4(place_of(hit), hit.front, 0.0);
#endif
}
