// Shadow rays to lamps without area, and what they bring. Each is sent to one of a set, chosen by what all would give unoccluded, w:
//
//   (Σ V w / p, and Σ over passes of the mean V²),    Σ Σ_i w_i
//
// To a lamp with a radius, or an angle, the ray goes to a point of its sphere, or its disc. Blended.
#define PASS  // shadow rays
#include "direct_light/light_sample.glsl"
#include "visibility/origin.glsl"
#include "visibility/rays.glsl"

uniform int u_lights;        // how many
uniform sampler2D t_passes;  // of PASS shadow rays, that each slot has had
uniform int u_stream;        // of random numbers

layout(location = 0) out vec4 out_seen;
layout(location = 1) out vec4 out_all;

float mean_of(vec3 w) { return dot(w, vec3(1.0 / 3.0)); }

bool sees(Light light, vec3 from, vec3 normal, vec2 share) {
    float far;
    vec3 way = towards(light, from, share, far);
    return dot(way, normal) > 0.0 && !any_hit(from, way, 0.0, far);
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    Origin o = load_origin(px);
    out_seen = out_all = vec4(0.0);
    if (!o.there) return;
    int first = PASS * int(texelFetch(t_passes, px / TILE, 0).r);
    for (int k = first; k < first + PASS; ++k) {
        vec4 share = numbers(o.place, uint(u_stream), k);
        vec3 from = start_of(o, share.zw), w = vec3(0.0), all = vec3(0.0);
        float number = share.x;
        int chosen = -1;
        for (int nth = 0; nth < u_lights; ++nth) {
            vec3 some = unoccluded(load_light(nth), from, o.normal);
            if (mean_of(some) <= 0.0) continue;
            all += some;
            float p = mean_of(some) / mean_of(all);  // to replace those before it
            bool takes = number < p;
            number = takes ? number / p : (number - p) / (1.0 - p);
            if (takes) { chosen = nth; w = some; }
        }
        if (chosen < 0) continue;
        out_all.rgb += all;
        if (sees(load_light(chosen), from, o.normal, vec2(number, share.y))) out_seen.rgb += w * mean_of(all) / mean_of(w);
    }
    float V = mean_of(out_seen.rgb) / max(mean_of(out_all.rgb), 1e-30);
    out_seen.a = V * V;
}
