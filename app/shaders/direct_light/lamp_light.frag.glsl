// The direct light of a set of lamps, E Σ F V, as its shadow rays have it so far. Blended.
#define CLOSED_FORM 1
#define PASS  // shadow rays
#include "common/tile.glsl"
uniform sampler2D t_shadow_rays;  // see shadow_rays.frag.glsl
#if CLOSED_FORM
uniform sampler2D t_unoccluded;
#endif
uniform vec3 u_exitance;  // of the set [stored units]
uniform sampler2D t_passes;  // of PASS shadow rays, that each slot has had

layout(location = 0) out vec4 out_direct;  // a: variance of the mean of RGB

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    vec4 s = texelFetch(t_shadow_rays, px, 0);
    float passes = max(texelFetch(t_passes, px / TILE, 0).r, 1.0);
    float mean = dot(u_exitance, vec3(1.0 / 3.0));
#if CLOSED_FORM
    float U = texelFetch(t_unoccluded, px, 0).r, V = s.g > 0.0 ? s.r / s.g : 0.0;
    float spread = max(s.b / passes - V * V, 0.0);
    vec3 D = u_exitance * U * V;
    mean *= U;
#else
    vec3 D = u_exitance * s.rgb / (passes * float(PASS));
    float M = dot(D, vec3(1.0 / 3.0));
    float spread = max(s.a / passes * mean * mean - M * M, 0.0);
    mean = 1.0;
#endif
    out_direct = vec4(D, mean * mean * spread / max(passes - 1.0, 1.0));
}
