// Whether something stands between a point and the next one of its chart along u (r), or along v (g): light on one side of it says
// nothing of that on the other. Seen from a tenth of their distance above both, more than a surface that turns by 20° rises between.
#include "common/texel_at.glsl"
#include "visibility/origin.glsl"
#include "visibility/rays.glsl"

layout(location = 0) out vec2 out_walls;

const float LIFT = 0.1;  // of the distance

bool wall_to(ivec2 px, ivec2 step) {
    vec3 leaf = texelFetch(t_leaves, px / TILE, 0).xyz;
    ivec2 next = texel_px_at((leaf.xy * float(TILE) + vec2(px % TILE + step) + 0.5) * leaf.z);
    if (next.y < 0 || texelFetch(t_origin_normal, next, 0).y != texelFetch(t_origin_normal, px, 0).y) return true;
    Origin a = load_origin(px), b = load_origin(next);
    float lift = LIFT * distance(a.position, b.position);
    vec3 from = a.position + lift * a.normal, way = b.position + lift * b.normal - from;
    float far = length(way);
    return far > 0.0 && any_hit(from, way / far, 0.0, far);
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    out_walls = vec2(0.0);
    if (texelFetch(t_origin, px, 0).w > 0.0) out_walls = vec2(wall_to(px, ivec2(1, 0)), wall_to(px, ivec2(0, 1)));
}
