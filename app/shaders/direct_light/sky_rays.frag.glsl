// Shadow rays to the sky, or to the sun's disc, and what they bring: with w = L cos θ / p of each, (Σ w V, and Σ over passes
// (Σ w V / Σ w)² of the mean of RGB), and Σ w. Blended.
#define PASS  // shadow rays
#define SUN 0
#include "visibility/origin.glsl"
#include "visibility/rays.glsl"
#if SUN
#include "direct_light/sun.glsl"
#else
#include "direct_light/sky_sample.glsl"
uniform float u_by_cosine;  // share of directions that are chosen by the cosine alone
#endif

uniform sampler2D t_passes;  // of PASS shadow rays, that each slot has had
uniform int u_stream;        // of random numbers

layout(location = 0) out vec4 out_seen;
layout(location = 1) out vec4 out_all;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    Origin o = load_origin(px);
    out_seen = out_all = vec4(0.0);
    if (!o.there) return;
    int first = PASS * int(texelFetch(t_passes, px / TILE, 0).r);
    for (int k = first; k < first + PASS; ++k) {
        vec4 share = numbers(o.place, uint(u_stream), k);
#if SUN
        vec3 direction = sun_direction(share.xy);
        float cosine = dot(direction, o.normal);
        vec3 w = vec3(cosine);
        if (cosine <= 0.0) continue;
#else
        vec3 direction;
        if (share.x < u_by_cosine) direction = cosine_direction(o.normal, vec2(share.x / u_by_cosine, share.y));
        else direction = sky_direction(vec2((share.x - u_by_cosine) / (1.0 - u_by_cosine), share.y));
        float cosine = dot(direction, o.normal);
        if (cosine <= 0.0) continue;
        vec2 uv = sky_uv(direction);
        float density = u_by_cosine * cosine / PI + (1.0 - u_by_cosine) * sky_density(direction, uv);
        vec3 w = textureLod(t_sky, uv, 0.0).rgb * cosine / density;
#endif
        out_all.rgb += w;
        if (!any_hit(start_of(o, share.zw), direction, 0.0, 2.0 * FAR)) out_seen.rgb += w;
    }
    float all = dot(out_all.rgb, vec3(1.0)), V = all > 0.0 ? dot(out_seen.rgb, vec3(1.0)) / all : 0.0;
    out_seen.a = V * V;
}
