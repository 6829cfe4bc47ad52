// The even ambient term, of which patches overshoot, is the irradiance that all unshot light will make on average, after all its
// reflections [Cohen88, eq. 9]; in an open scene:
//
//   Φ f (1 + ρf + ρ²f² + …) / A = Φ f / (A (1 - ρf))
//
// Φ: unshot power; ρ: mean albedo; f: share of what was shot until now that stayed in the scene; A: area of all texels.
//
// Where light comes from directions, much of what patches shoot may leave the scene, but in rooms little does. So what is overshot,
// which makes up for it later, takes f of all light, from outside too: of a living room lit through its windows 3.3 % are unshot
// after as long as 3.8 % with the other f.
#include "solvers/shooting/shooter.glsl"
#include "solvers/shooting/so_far.glsl"

uniform sampler2D t_unshot;  // of bins: Σ r A, and Σ |Σ r A| over tiles, summed over RGB, before the batch
uniform sampler2D t_shooters;
uniform int u_shots;  // of a batch that has shot since
uniform vec3 u_albedo;
uniform float u_area;  // solver space

layout(location = 0) out vec4 out_ambient;

const float LEAST_LOST = 0.01;  // at a bounce: with less, errors of form factors would be overshot, a thousandfold
const float CANCELS = 1e-6;  // under this share of Σ |Σ r A| over tiles, Σ r A is what rounding leaves

void main() {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < textureSize(t_unshot, 0).x; ++i) sum += texelFetch(t_unshot, ivec2(i, 0), 0);
    vec3 batch = vec3(0.0);
    for (int shot = 0; shot < u_shots; ++shot) {
        Shooter s = load_shooter(t_shooters, shot);
        if (size_px(s) > 0) batch += s.exitance * s.area;
    }
    vec3 unshot = mix(vec3(0.0), sum.rgb, greaterThan(abs(sum.rgb), vec3(CANCELS * sum.a)));
    SoFar all = so_far();
    vec3 stays = share_stayed(all.shot + all.directions, all.gone);
    unshot -= batch * (1.0 - u_albedo * stays);  // what it shot, and what surfaces keep of that to shoot
    out_ambient = vec4(unshot * stays / max(u_area * max(1.0 - u_albedo * stays, LEAST_LOST), 1e-30), 0.0);
}
