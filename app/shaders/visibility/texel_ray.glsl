// The k-th ray of a point, and what it hits [Kahl22]. It is the same whenever it is traced.
#include "common/texel_at.glsl"
#include "visibility/hit.glsl"
#include "visibility/origin.glsl"
#include "visibility/rays.glsl"

uint trace(Origin o, int k) {
    vec3 start, direction;
    kth_ray(o, k, start, direction);
    Hit hit = closest_hit(start, direction, 0.0, 2.0 * FAR);
    if (hit.slot < 0) return no_texel(ESCAPED);
    vec2 place = place_of(hit);
    ivec2 px = place.x < 0.0 ? ivec2(-1) : texel_px_at(place);
    return px.y < 0 ? no_texel(BLACK) : hit_of(px);
}
