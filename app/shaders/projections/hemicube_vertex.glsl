// Draws the hemicube, vertex side: clip position and the four planes that keep a view inside its part of the map.
#include "common/item.glsl"
#include "projections/hemicube.glsl"

in vec3 in_position;
in vec2 in_sides;  // of the triangle that this vertex ends: item of its front, of its back

out gl_PerVertex {
    vec4 gl_Position;
    float gl_ClipDistance[4];
};
flat out vec2 v_sides;
flat out float v_own;

void draw(int view, vec3 origin, mat3 axes, float facet, int shot, int shots) {
    vec3 v = view_from_local(view, (in_position - origin) * axes);
    vec2 maps_px = MAP_PX * vec2(1.0, float(shots));
    vec2 centre_ndc = 2.0 * (view_origin_px(view) + vec2(0.0, float(shot) * MAP_PX.y)) / maps_px - 1.0;
    // z = -w at w = COPLANAR: the near plane; depth itself is written linearly by the fragment
    gl_Position = vec4(centre_ndc * v.z + 2.0 * HALF_R * v.xy / maps_px, v.z - 2.0 * COPLANAR, v.z);
    gl_ClipDistance[0] = v.z + v.x;
    gl_ClipDistance[1] = v.z - v.x;
    gl_ClipDistance[2] = view == 0 ? v.z + v.y : v.y;
    gl_ClipDistance[3] = v.z - v.y;
    v_sides = in_sides;
    v_own = facet;
}
