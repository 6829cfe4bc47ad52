// What lamps, and sources outside, have yet to give goes where light came from the start, since few rays of gather points would
// find it: rooms without lamps are not lit by what those of others have yet to shoot.
//
// A texel has so many times what it has received, Φ over what all have: a source gives its light in many shots, and the rest of them
// light about what the first did. Of lamps Φ is f of what is unshot, f the share of what was shot until now that stayed in the
// scene. But one lamp, or a sun, lights other places than the lamps, or the sky, that follow: a texel has MOST times the mean at most.
//
// The rest is even until gather points know it of each texel: what surfaces have yet to shoot, and all reflections of that, of lamps
// and of what comes from outside:
//
//   ((Φ_surfaces + ρ Φ_outside) f + ρ Φ_lamps f²) / (A (1 - ρf))
//
// Neither is even where rooms are closed, nor do all lamps light where the first one does: of both no more is shown than is usual
// on what the camera sees, by a forecast.
//
// The first f is that of all light, from outside too, as in the even ambient term; reflections take that of what patches shot: until
// these have, nobody knows how much leaves the scene through the windows that let it in.
#include "solvers/shooting/so_far.glsl"

uniform sampler2D t_lamps;  // one texel: Σ r A of lamps, and Σ |r A| over blocks, summed over RGB
uniform sampler2D t_even;   // one texel, see even_ambient.frag.glsl
uniform vec3 u_albedo;
uniform float u_area;  // of all texels, solver space
uniform vec3 u_outside;  // power that is still to come from outside
uniform float u_ahead;   // and over what has come from there, as long as the host does not know that
uniform float u_rest;    // 0 leaves out the rest
uniform vec3 u_usual;    // [stored units]

layout(location = 0) out vec4 out_to_come;  // see common/even_ambient.glsl

const float CANCELS = 1e-6;  // under this share of Σ |r A|, Σ r A is what rounding leaves
const float MOST = 8.0;
const float LEAST_LOST = 0.01;  // as in even_ambient.frag.glsl

void main() {
    vec4 lamps = texelFetch(t_lamps, ivec2(0), 0);
    vec3 unshot = mix(vec3(0.0), lamps.rgb, greaterThan(abs(lamps.rgb), vec3(CANCELS * lamps.a)));
    SoFar all = so_far();
    vec3 stays = share_stayed(all.shot, all.gone), arrived = max(all.shot * stays + all.directions, vec3(1e-30));
    vec3 outside = u_outside + u_ahead * all.directions, to_come = unshot * stays + outside;
    vec3 of_all = share_stayed(all.shot + all.directions, all.gone);
    float area = max(u_area, 1e-30);
    vec3 all_unshot = texelFetch(t_even, ivec2(0), 0).rgb * area * max(1.0 - u_albedo * of_all, LEAST_LOST) / max(of_all, 1e-6);
    vec3 reflected = u_albedo * stays, at_first = (all_unshot - unshot + u_albedo * outside) * of_all;
    vec3 even = (at_first + reflected * unshot * stays) / (area * max(1.0 - reflected, LEAST_LOST));
    int which = int(gl_FragCoord.x);
    vec3 most = MOST * abs(outside) / area + min(MOST * abs(unshot * stays) / area, u_usual);
    out_to_come = vec4(which == 0 ? u_rest * min(even, u_usual) : which == 1 ? to_come / arrived : most, 0.0);
}
