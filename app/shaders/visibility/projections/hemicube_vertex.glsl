// Draws the hemicube, vertex side: clip position and the four planes that keep a view inside its part of the map.
#include "visibility/projections/hemicube_views.glsl"

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
    gl_Position = clip_from_view(view, v, shot, shots);
    vec4 inside = inside_view(view, v);
    for (int plane = 0; plane < 4; ++plane) gl_ClipDistance[plane] = inside[plane];
    v_sides = in_sides;
    v_own = facet;
}
