// Triangles that would vanish between the samples of the map, each as one point in the sample that holds its middle: [Wallner10,
// 5.1] found them missing. Small is what at most two samples in a row could hit, and none does.
#include <projection>
#include "visibility/projections/triangles.glsl"
#include "solvers/shooting/shooter_block.glsl"
#define COUNT 0  // 1: all of a shot's into one texel, to be added up
#define OPACITY 0
#if OPACITY
#include "visibility/opacity.glsl"
#endif

uniform int u_maps;
uniform sampler2D t_triangles;

flat out vec2 v_seen;  // item, depth

bool hit(Triangle t, vec3 sight) {
    float a = dot(cross(t.a, t.b), sight), b = dot(cross(t.b, t.c), sight), c = dot(cross(t.c, t.a), sight);
    return min(a, min(b, c)) >= 0.0 || max(a, max(b, c)) <= 0.0;
}

// t in the axes of the view
bool vanishes(int view, Triangle t) {
    vec2 a = px_from_view(view, t.a), b = px_from_view(view, t.b), c = px_from_view(view, t.c);
    ivec2 first = ivec2(ceil(min(a, min(b, c)) - 0.5)), last = ivec2(floor(max(a, max(b, c)) - 0.5));
    if (any(greaterThan(last - first, ivec2(1)))) return false;
    for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x)
            if (hit(t, sight_from_px(view, vec2(x, y) + 0.5))) return false;
    return true;
}

void main() {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    v_seen = vec2(0.0);
    Shooter s = shooter_of(gl_InstanceID);
    Triangle local = seen_from(load_triangle(t_triangles, gl_VertexID), s.origin, world_axes(s));
    if (size_px(s) == 0 || unseen(local, plane_of(local), float(s.facet))) return;
    vec3 middle = (local.a + local.b + local.c) / 3.0;
    int view = view_from_direction(middle);
    Triangle t = local;
    t.a = view_from_local(view, local.a);
    t.b = view_from_local(view, local.b);
    t.c = view_from_local(view, local.c);
    vec3 depths = vec3(depth_from_view(t.a), depth_from_view(t.b), depth_from_view(t.c));
    float nearest = min(depths.x, min(depths.y, depths.z)), furthest = max(depths.x, max(depths.y, depths.z));
    if (middle.z <= COPLANAR || nearest <= 0.0 || !vanishes(view, t)) return;

    vec2 px = floor(px_from_view(view, view_from_local(view, middle))) + 0.5;
    vec4 plane = plane_of(t);
    float depth = plane.w / dot(plane.xyz, sight_from_px(view, px));
#if OPACITY
    vec3 at_local = local_from_view(view, sight_from_px(view, px) * clamp(depth, nearest, furthest));
    vec3 place = world_from_local(s, at_local);
    if (chance_in_map(s.origin, ivec2(px), gl_VertexID) >= opacity_at(gl_VertexID, place)) return;
#endif
    v_seen = vec2(plane_of(local).w < 0.0 ? t.sides.r : t.sides.g, clamp(depth, nearest, furthest));
    vec2 at = COUNT == 1 ? vec2(0.5) : px / MAP_PX;
    gl_Position = vec4(2.0 * vec2(at.x, (at.y + float(gl_InstanceID)) / float(u_maps)) - 1.0, 0.0, 1.0);
}
