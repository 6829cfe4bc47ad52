// Shadow rays to lamps without area. Each is sent to one of a set, chosen by what all would give unoccluded, w: it brings w / p. To a
// lamp with a radius, or an angle, it goes to a point of its sphere, or its disc.
#define PASS  // shadow rays
#include "direct_light/light_sample.glsl"
#include "direct_light/shadow_ray.glsl"
#include "visibility/origin.glsl"
#include "visibility/rays.glsl"

uniform int u_lights;  // how many

float mean_of(vec3 w) { return dot(w, vec3(1.0 / 3.0)); }

ShadowRay ray_to(vec3 from, vec3 normal, vec2 share) {
    ShadowRay ray = ShadowRay(from, normal, 0.0, vec3(0.0), vec3(0.0));
    vec3 w = vec3(0.0);
    float number = share.x;
    int chosen = -1;
    for (int nth = 0; nth < u_lights; ++nth) {
        vec3 some = unoccluded(load_light(nth), from, normal);
        if (mean_of(some) <= 0.0) continue;
        ray.all += some;
        float p = mean_of(some) / mean_of(ray.all);  // to replace those before it
        bool takes = number < p;
        number = takes ? number / p : (number - p) / (1.0 - p);
        if (takes) { chosen = nth; w = some; }
    }
    if (chosen < 0) return ray;
    ray.brings = w * mean_of(ray.all) / mean_of(w);
    ray.way = towards(load_light(chosen), from, vec2(number, share.y), ray.far);
    if (dot(ray.way, normal) <= 0.0) ray.far = 0.0;
    return ray;
}
#include "direct_light/rays_loop.glsl"
