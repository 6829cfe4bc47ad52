// What lamps, and sources outside, have yet to give goes where light came from the start, since few rays of gather points would
// find it: rooms without lamps are not lit by what those of others have yet to shoot.
//
// A texel has so many times what it has received, Φ over what all have: a source gives its light in many shots, and the rest of them
// light about what the first did. Of lamps Φ is f of what is unshot, f the share of what was shot until now that stayed in the
// scene. But one lamp, or a sun, lights other places than the lamps, or the sky, that follow: a texel has MOST times the mean at most.
//
// The rest is even until gather points know it of each texel: of the even ambient term what lamps give at once is left out, and what
// all that comes from outside will give, reflected, is added:
//
//   a - Φ_lamps f / A + ρf Φ_outside / (A (1 - ρf))
#include "solvers/shooting/so_far.glsl"

uniform sampler2D t_lamps;  // one texel: Σ r A of lamps, and Σ |r A| over blocks, summed over RGB
uniform sampler2D t_even;   // one texel, see even_ambient.frag.glsl
uniform vec3 u_albedo;
uniform float u_area;  // of all texels, solver space
uniform vec3 u_outside;  // power that is still to come from outside
uniform float u_rest;    // 0 leaves out the rest

layout(location = 0) out vec4 out_to_come;  // see common/even_ambient.glsl

const float CANCELS = 1e-6;  // under this share of Σ |r A|, Σ r A is what rounding leaves
const float MOST = 8.0;
const float LEAST_LOST = 0.01;  // as in even_ambient.frag.glsl

void main() {
    vec4 lamps = texelFetch(t_lamps, ivec2(0), 0);
    vec3 unshot = mix(vec3(0.0), lamps.rgb, greaterThan(abs(lamps.rgb), vec3(CANCELS * lamps.a)));
    SoFar all = so_far();
    vec3 stays = share_stayed(all.shot, all.gone), arrived = max(all.shot * stays + all.directions, vec3(1e-30));
    vec3 to_come = unshot * stays + u_outside, stays_of_all = share_stayed(all.shot + all.directions, all.gone);
    vec3 reflected = u_albedo * stays_of_all, area = vec3(max(u_area, 1e-30));
    vec3 even = texelFetch(t_even, ivec2(0), 0).rgb - unshot * stays_of_all / area;
    even += u_outside * reflected / (area * max(1.0 - reflected, LEAST_LOST));
    int which = int(gl_FragCoord.x);
    out_to_come = vec4(which == 0 ? u_rest * even : which == 1 ? to_come / arrived : MOST * abs(to_come) / area, 0.0);
}
