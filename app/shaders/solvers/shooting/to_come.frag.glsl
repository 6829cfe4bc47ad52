// What lamps, and sources outside, have yet to give goes where light came from the start, since few rays of gather points would
// find it: rooms without lamps are not lit by what those of others have yet to shoot.
//
// A texel has so many times what it has received, Φ over what all have: a source gives its light in many shots, and the rest of them
// light about what the first did. Of lamps Φ is f of what is unshot, f the share of what was shot until now that stayed in the
// scene. But one lamp, or a sun, lights other places than the lamps, or the sky, that follow: a texel has MOST times the mean at most.
#include "solvers/shooting/so_far.glsl"

uniform sampler2D t_lamps;  // one texel: Σ r A of lamps, and Σ |r A| over blocks, summed over RGB
uniform float u_area;  // of all texels, solver space
uniform vec3 u_outside;         // power that is still to come from outside

layout(location = 0) out vec4 out_to_come;  // over what has arrived; the second pixel: the most, irradiance

const float CANCELS = 1e-6;  // under this share of Σ |r A|, Σ r A is what rounding leaves
const float MOST = 8.0;

void main() {
    vec4 lamps = texelFetch(t_lamps, ivec2(0), 0);
    vec3 unshot = mix(vec3(0.0), lamps.rgb, greaterThan(abs(lamps.rgb), vec3(CANCELS * lamps.a)));
    SoFar all = so_far();
    vec3 stays = share_stayed(all.shot, all.gone), arrived = max(all.shot * stays + all.directions, vec3(1e-30));
    vec3 to_come = unshot * stays + u_outside;
    out_to_come = vec4(gl_FragCoord.x < 1.0 ? to_come / arrived : MOST * abs(to_come) / max(u_area, 1e-30), 0.0);
}
