// Where a view of one of several hemicubes, one above the other, draws: clip position, and the planes that keep it in its part.
#include "common/item.glsl"
#include "visibility/projections/hemicube.glsl"

// v: as the view sees it, (a, b, w)
vec4 clip_from_view(int view, vec3 v, int map, int maps) {
    vec2 maps_px = MAP_PX * vec2(1.0, float(maps));
    vec2 centre_ndc = 2.0 * (view_origin_px(view) + vec2(0.0, float(map) * MAP_PX.y)) / maps_px - 1.0;
    // z = -w at w = COPLANAR: the near plane; depth itself is written linearly by the fragment
    return vec4(centre_ndc * v.z + 2.0 * HALF_R * v.xy / maps_px, v.z - 2.0 * COPLANAR, v.z);
}

vec4 inside_view(int view, vec3 v) { return vec4(v.z + v.x, v.z - v.x, view == 0 ? v.z + v.y : v.y, v.z - v.y); }
