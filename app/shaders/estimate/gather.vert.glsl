// All surfaces from points, each in a random turn about its normal: hemicubes one above the other, all views in one draw.
#define VIEWS 5
#include "visibility/projections/hemicube_views.glsl"

uniform sampler2D t_points;  // a row for each map: origin, first axis, normal
uniform int u_maps;

in vec3 in_position;
in vec2 in_uv_front;
in vec2 in_uv_back;

out gl_PerVertex {
    vec4 gl_Position;
    float gl_ClipDistance[4];
};
out vec4 v_uv;
flat out ivec2 v_view;  // view, map

void main() {
    int view = gl_InstanceID % VIEWS, map = gl_InstanceID / VIEWS;
    vec3 x = texelFetch(t_points, ivec2(1, map), 0).xyz, z = texelFetch(t_points, ivec2(2, map), 0).xyz;
    vec3 origin = texelFetch(t_points, ivec2(0, map), 0).xyz + 2.0 * COPLANAR * z;  // off its own surface
    vec3 v = view_from_local(view, (in_position - origin) * mat3(x, cross(z, x), z));
    gl_Position = clip_from_view(view, v, map, u_maps);
    vec4 inside = inside_view(view, v);
    for (int plane = 0; plane < 4; ++plane) gl_ClipDistance[plane] = inside[plane];
    v_uv = vec4(in_uv_front, in_uv_back);
    v_view = ivec2(view, map);
}
