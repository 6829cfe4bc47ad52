// Visibility V is how much of the shooter a receiver point sees: the four map samples around it, weighted bilinearly.
// A map sample is an item and its depth along the sight; the open background is item 0 at depth FAR.
//
//   VISIBILITY 0, item id   a sample sees the receiver if it shows the receiver's facet [Coombe03, 3.2]
//   VISIBILITY 1, depth     or if what it shows is no nearer than the receiver's own plane along that sample's sight
//   VISIBILITY 2, combined  either: ids save receivers from depth error, depth saves small triangles from id error; but not what
//                           shows another facet where that plane is, and does not see the receiver, see visibility/behind.glsl
//
// With POINT, where what looks is one point, whose errors no others even out: where some of the four see the receiver, the others
// hide it only if it is behind what they show.
#define VISIBILITY 2
#define POINT 0
#include "visibility/behind.glsl"

// Depth is single precision, interpolated across triangles that may be as long as the scene: 2^-14 of it covers the rounding
// (2^-23 a step) and is far below a texel.
const float DEPTH_SLACK = 1.0 / 16384.0;

// the maps of several shots above each other
uniform sampler2D t_items;
uniform sampler2D t_depth;  // in units of FAR

// The sight of the i-th of the four samples around a corner of the map, in the order of textureGather.
vec3 ith_sight(int view, vec2 middle, int i) {
    return local_from_view(view, sight_from_px(view, middle + vec2(i == 1 || i == 2 ? 0.5 : -0.5, i < 2 ? 0.5 : -0.5)));
}

// position: of the receiver, axes: of local vectors, both in the solver space
float visible(float facet, vec3 position, vec3 local, vec3 normal_local, mat3 axes, int shot) {
    int view = view_from_direction(local);
    vec3 point = view_from_local(view, local), normal = view_from_local(view, normal_local);
    vec4 bounds = view_bounds_px(view);
    vec2 at = clamp(px_from_view(view, point), bounds.xy + 0.5, bounds.zw - 0.5) - 0.5;
    vec2 base = min(floor(at), bounds.zw - 2.0);
    vec2 f = at - base, middle = base + 1.0;  // of the four
    vec2 uv = (middle + vec2(0.0, float(shot) * MAP_PX.y)) / vec2(textureSize(t_items, 0));
    bvec4 seen = bvec4(false);
#if VISIBILITY != 1
    vec4 items = textureGather(t_items, uv);
    seen = equal(items, vec4(facet));
#endif
    float plane = dot(normal, point);
#if VISIBILITY != 0
    // where each sample's sight meets the receiver's plane; past its horizon, the receiver's own depth
    vec4 slope = sights_dot(view, middle, normal);
    vec4 depth = mix(vec4(depth_from_view(point)), plane / slope, lessThan(slope, vec4(0.0)));
    vec4 shown = FAR * textureGather(t_depth, uv);
    bvec4 open = greaterThanEqual(shown, depth * (1.0 - DEPTH_SLACK));
    seen = bvec4(seen.x || open.x, seen.y || open.y, seen.z || open.z, seen.w || open.w);
#endif
    vec4 weight = vec4((1.0 - f.x) * f.y, f.x * f.y, f.x * (1.0 - f.y), (1.0 - f.x) * (1.0 - f.y)) * on_hemisphere(middle);
#if VISIBILITY == 2
    vec4 beyond = shown - depth, other = vec4(notEqual(items, vec4(facet))) * vec4(notEqual(items, vec4(UNCHARTED)));
    bvec4 beside = bvec4(other * vec4(lessThanEqual(abs(beyond), DEPTH_SLACK * depth)));
    if (any(beside)) {
        for (int i = 0; i < 4; ++i) {
            if (!beside[i]) continue;
            bool tells;
            seen[i] = sees_beside(items[i], facet, beyond[i], position, axes * ith_sight(view, middle, i), tells);
            weight[i] *= float(tells);
        }
    }
#endif
#if POINT && VISIBILITY == 2
    if (any(seen) && !all(seen)) {
        for (int i = 0; i < 4; ++i)
            if (!seen[i]) seen[i] = !behind(items[i], position, axes * ith_sight(view, middle, i));
    }
#endif
    float told = dot(weight, vec4(1.0)), share = told > 0.0 ? dot(vec4(seen), weight) / told : 1.0;
    // the other side of what is seen: a shell without thickness has texels on both, in the same place
    return plane < 0.0 ? share : 0.0;
}
