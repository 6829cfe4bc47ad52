// All surfaces from points, each in a random turn about its normal: hemicubes one above the other, all views in one draw.
#define VIEWS 5
#include "common/item.glsl"
#include "projections/hemicube.glsl"

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
    vec2 maps_px = MAP_PX * vec2(1.0, float(u_maps));
    vec2 centre_ndc = 2.0 * (view_origin_px(view) + vec2(0.0, float(map) * MAP_PX.y)) / maps_px - 1.0;
    gl_Position = vec4(centre_ndc * v.z + 2.0 * HALF_R * v.xy / maps_px, v.z - 2.0 * COPLANAR, v.z);
    gl_ClipDistance[0] = v.z + v.x;
    gl_ClipDistance[1] = v.z - v.x;
    gl_ClipDistance[2] = view == 0 ? v.z + v.y : v.y;
    gl_ClipDistance[3] = v.z - v.y;
    v_uv = vec4(in_uv_front, in_uv_back);
    v_view = ivec2(view, map);
}
