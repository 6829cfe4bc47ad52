// What was shot until now, by the ledger.
#include "solvers/shooting/ledger.glsl"

uniform sampler2D t_ledger;

struct SoFar { vec3 shot, gone, directions; };

SoFar so_far() {
    SoFar sum = SoFar(vec3(0.0), vec3(0.0), vec3(0.0));
    for (int i = 0; i < textureSize(t_ledger, 0).x; ++i) {
        Ledger entry = load_ledger(t_ledger, i);
        sum.gone += entry.escaped + entry.blackened;
        sum.shot += entry.shot;
        sum.directions += entry.directions;
    }
    return sum;
}

// The share of all of this that stayed in the scene.
vec3 share_stayed(vec3 all, vec3 gone) {
    vec3 stays = clamp(1.0 - gone / max(all, vec3(1e-30)), 0.0, 1.0);
    return mix(vec3(0.0), stays, greaterThan(all, vec3(0.0)));
}
