// The direct light of a set of lamps without area, as its shadow rays have it so far: the mean of V w / p. Blended.
#define PASS  // shadow rays
#include "common/tile.glsl"
uniform sampler2D t_seen;  // see rays_loop.glsl
uniform sampler2D t_all;
uniform sampler2D t_passes;  // of PASS shadow rays, that each slot has had
uniform vec3 u_scale;        // to stored units

layout(location = 0) out vec4 out_direct;  // a: variance of the mean of RGB

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    vec4 seen = texelFetch(t_seen, px, 0);
    vec3 all = texelFetch(t_all, px, 0).rgb;
    float passes = max(texelFetch(t_passes, px / TILE, 0).r, 1.0), sum = dot(all, vec3(1.0));
    float V = sum > 0.0 ? dot(seen.rgb, vec3(1.0)) / sum : 0.0;
    float mean = dot(u_scale * all, vec3(1.0 / 3.0)) / (passes * float(PASS));
    out_direct = vec4(
        u_scale * seen.rgb / (passes * float(PASS)), mean * mean * max(seen.a / passes - V * V, 0.0) / max(passes - 1.0, 1.0)
    );
}
