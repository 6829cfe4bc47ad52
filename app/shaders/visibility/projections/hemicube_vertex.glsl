// Draws the hemicube, vertex side: clip position and the four planes that keep a view inside its part of the map.
#include "common/item.glsl"
#include "visibility/projections/hemicube.glsl"

in vec3 in_position;
in vec2 in_sides;  // of the triangle that this vertex ends: item of its front, of its back

out gl_PerVertex {
    vec4 gl_Position;
    float gl_ClipDistance[4];
};
flat out vec2 v_sides;
flat out float v_own;

// v: as the view sees it, (a, b, w)
vec4 clip_from_view(int view, vec3 v, int map, int maps) {
    vec2 maps_px = MAP_PX * vec2(1.0, float(maps));
    vec2 centre_ndc = 2.0 * (view_origin_px(view) + vec2(0.0, float(map) * MAP_PX.y)) / maps_px - 1.0;
    // z = -w at w = COPLANAR: the near plane; depth itself is written linearly by the fragment
    return vec4(centre_ndc * v.z + 2.0 * HALF_R * v.xy / maps_px, v.z - 2.0 * COPLANAR, v.z);
}

vec4 inside_view(int view, vec3 v) { return vec4(v.z + v.x, v.z - v.x, view == 0 ? v.z + v.y : v.y, v.z - v.y); }

void draw(int view, vec3 origin, mat3 axes, float facet, int shot, int shots) {
    vec3 v = view_from_local(view, (in_position - origin) * axes);
    gl_Position = clip_from_view(view, v, shot, shots);
    vec4 inside = inside_view(view, v);
    for (int plane = 0; plane < 4; ++plane) gl_ClipDistance[plane] = inside[plane];
    v_sides = in_sides;
    v_own = facet;
}
