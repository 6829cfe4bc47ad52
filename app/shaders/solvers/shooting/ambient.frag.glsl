// The ambient term is the irradiance that all unshot light will make on average, after all its reflections [Cohen88, eq. 9]; in
// an open scene:
//
//   Φ f (1 + ρf + ρ²f² + …) / A = Φ f / (A (1 - ρf))
//
// Φ: unshot power; ρ: mean albedo; f: share of what was shot until now that stayed in the scene; A: area of all texels. Light from
// outside that is to come meets texels as a whole: Φ / (A (1 - ρf)).
//
// Where light comes from directions, much of what patches shoot may leave the scene, but in rooms little does. So what is overshot,
// which makes up for it later, takes f of all light, from outside too: of a living room lit through its windows 3.3 % are unshot
// after as long as 3.8 % with the other f.
#include "solvers/shooting/shooter.glsl"
#include "solvers/shooting/ledger.glsl"

uniform sampler2D t_unshot;  // of bins: Σ r A, and Σ |Σ r A| over tiles, summed over RGB, before the batch
uniform sampler2D t_ledger;
uniform sampler2D t_shooters;
uniform int u_shots;  // of a batch that has shot since
uniform vec3 u_albedo;
uniform float u_area;  // solver space
uniform int u_overshoots;       // 1: it is to be overshot; 0: to be shown
uniform vec3 u_outside;         // power that is still to come from outside
uniform float u_to_each_given;  // shots of that for each that was made

layout(location = 0) out vec4 out_ambient;  // a: see common/ambient.glsl

const float SHARES = 4.0;  // fewer leave rooms without lamps dark that get all of their light late, more light dark corners
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
    vec3 shot = vec3(0.0), gone = vec3(0.0), directions = vec3(0.0);
    for (int i = 0; i < textureSize(t_ledger, 0).x; ++i) {
        Ledger entry = load_ledger(t_ledger, i);
        gone += entry.escaped + entry.blackened;
        shot += entry.shot;
        directions += entry.directions;
    }
    vec3 all = shot + float(u_overshoots) * directions;
    vec3 stays = clamp(1.0 - gone / max(all, vec3(1e-30)), 0.0, 1.0);
    stays = mix(vec3(0.0), stays, greaterThan(all, vec3(0.0)));
    unshot -= batch * (1.0 - u_albedo * stays);  // what it shot, and what surfaces keep of that to shoot
    vec3 ambient = (unshot * stays + u_outside) / max(u_area * max(1.0 - u_albedo * stays, LEAST_LOST), 1e-30);
    vec3 arrived = (shot * stays + directions) / u_area;
    float share = dot(abs(ambient), vec3(1.0)) / max(dot(abs(arrived), vec3(1.0)), 1e-30);
    out_ambient = vec4(ambient, max(min(1.0, SHARES * share), u_to_each_given));
}
