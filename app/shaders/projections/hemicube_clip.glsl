// Vertex side of the hemicube: clip position and the four planes that keep a view inside its part of the map.
#include "common/item.glsl"
#include "projections/hemicube.glsl"

out gl_PerVertex {
    vec4 gl_Position;
    float gl_ClipDistance[4];
};

// Draws the vertex into its view.
void project(int view, vec3 local) {
    vec3 v = view_from_local(view, local);
    vec2 map_px = vec2(3.0, 1.0) * R;
    vec2 centre_ndc = 2.0 * view_origin_px(view) / map_px - 1.0;
    // z = -w at w = COPLANAR: the near plane; depth itself is written linearly by the fragment
    gl_Position = vec4(centre_ndc * v.z + 2.0 * HALF_R * v.xy / map_px, v.z - 2.0 * COPLANAR, v.z);
    gl_ClipDistance[0] = v.z + v.x;
    gl_ClipDistance[1] = v.z - v.x;
    gl_ClipDistance[2] = view == 0 ? v.z + v.y : v.y;
    gl_ClipDistance[3] = v.z - v.y;
}
