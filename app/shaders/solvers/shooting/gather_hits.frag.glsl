// What the rays of gather points hit: a square of pixels for each point, a pixel for each ray. All points look along the same
// directions about their normals, so that what they find differs no more than what they see does: light is smooth, not noisy.
#include "common/texel_at.glsl"
#include "common/hemisphere.glsl"
#include "common/item.glsl"
#include "solvers/shooting/gather_point.glsl"
#include "visibility/hit.glsl"
#include "visibility/rays.glsl"
#define RAY_EDGE  // rays of a point along the edge of its square

layout(location = 0) out uint out_hit;

const float ABOVE = 0.05;  // edges of a texel: a point of a curved surface may lie below it

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy), block = px / RAY_EDGE, nth = px % RAY_EDGE;
    Texel texel = gather_point(block);
    out_hit = no_texel(NONE);
    if (texel.area <= 0.0) return;
    vec3 start = texel.position + (2.0 * COPLANAR + ABOVE * sqrt(texel.area)) * texel.normal;
    vec3 direction = cosine_direction(texel.normal, numbers(ivec3(0), 0u, nth.y * RAY_EDGE + nth.x).xy);
    Hit hit = closest_hit(start, direction, 0.0, 2.0 * FAR);
    vec2 place = hit.slot < 0 ? vec2(-1.0) : place_of(hit);
    ivec2 found = place.x < 0.0 ? ivec2(-1) : texel_px_at(place);
    out_hit = found.y < 0 ? no_texel(ESCAPED) : hit_of(found);
}
