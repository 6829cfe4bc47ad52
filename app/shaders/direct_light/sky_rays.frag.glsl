// Shadow rays to the sky. Each brings w = L cos θ / p.
#define PASS  // shadow rays
#include "direct_light/shadow_ray.glsl"
#include "direct_light/sky_sample.glsl"
#include "visibility/origin.glsl"
#include "visibility/rays.glsl"

uniform float u_by_cosine;  // share of directions that are chosen by the cosine alone

ShadowRay ray_to(vec3 from, vec3 normal, vec2 share) {
    ShadowRay ray = ShadowRay(from, normal, 0.0, vec3(0.0), vec3(0.0));
    if (share.x < u_by_cosine) ray.way = cosine_direction(normal, vec2(share.x / u_by_cosine, share.y));
    else ray.way = sky_direction(vec2((share.x - u_by_cosine) / (1.0 - u_by_cosine), share.y));
    float cosine = dot(ray.way, normal);
    if (cosine <= 0.0) return ray;
    vec2 uv = sky_uv(ray.way);
    float density = u_by_cosine * cosine / PI + (1.0 - u_by_cosine) * sky_density(ray.way, uv);
    ray.brings = ray.all = textureLod(t_sky, uv, 0.0).rgb * cosine / density;
    ray.far = 2.0 * FAR;
    return ray;
}
#include "direct_light/rays_loop.glsl"
