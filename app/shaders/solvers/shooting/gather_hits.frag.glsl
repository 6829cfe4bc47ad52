// What the rays of gather points hit, each of them once: see ray_of_point.glsl for which pixel holds which.
#include "common/texel_at.glsl"
#include "common/hemisphere.glsl"
#include "common/item.glsl"
#include "solvers/shooting/gather_point.glsl"
#include "solvers/shooting/ray_of_point.glsl"
#include "visibility/hit.glsl"
#include "visibility/rays.glsl"

layout(location = 0) out uint out_hit;

const float ABOVE = 0.05;  // edges of a texel: a point of a curved surface may lie below it

void main() {
    ivec3 ray = ray_at(ivec2(gl_FragCoord.xy));
    Texel texel = gather_point(ray.xy);
    out_hit = no_texel(NONE);
    if (texel.area <= 0.0) return;
    vec3 start = texel.position + (2.0 * COPLANAR + ABOVE * sqrt(texel.area)) * texel.normal;
    int number = part_of(ray.xy) * RAY_EDGE * RAY_EDGE + ray.z;
    vec3 direction = cosine_direction(texel.normal, numbers(ivec3(0), 0u, number).xy);
    Hit hit = closest_hit(start, direction, 0.0, 2.0 * FAR);
    vec2 place = hit.slot < 0 ? vec2(-1.0) : place_of(hit);
    ivec2 found = place.x < 0.0 ? ivec2(-1) : texel_px_at(place);
    out_hit = found.y < 0 ? no_texel(ESCAPED) : hit_of(found);
}
