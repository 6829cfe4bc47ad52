// Every triangle once, with what its sides show where they have no texels.
uniform mat4 u_clip_from_local;
uniform sampler2D t_unlit;

in vec3 in_position;
in vec2 in_uv_front;
in vec2 in_uv_back;
in uint in_material;
#define OPACITY 0
#if OPACITY
in uint in_row;
flat out uint v_row;  // of t_sheer
out vec3 v_position;  // solver space
#endif

out vec4 v_uv;  // atlas texels: front, back; negative without texels
flat out vec3 v_unlit_front;
flat out vec3 v_unlit_back;

invariant gl_Position;  // render/textured draws over it

void main() {
    v_uv = vec4(in_uv_front, in_uv_back);
#if OPACITY
    v_row = in_row;
    v_position = in_position;
#endif
    v_unlit_front = texelFetch(t_unlit, ivec2(in_material, 0), 0).rgb;
    v_unlit_back = texelFetch(t_unlit, ivec2(in_material, 1), 0).rgb;
    gl_Position = u_clip_from_local * vec4(in_position, 1.0);
}
