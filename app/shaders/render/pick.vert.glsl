// The triangles again, with what a click wants to know.
uniform mat4 u_clip_from_local;

in vec3 in_position;
in vec2 in_uv_front;
in vec2 in_uv_back;

out vec3 v_position;
out vec4 v_uv;
#define OPACITY 0
#if OPACITY
in uint in_row;
flat out uint v_row;
#endif

void main() {
    v_position = in_position;
#if OPACITY
    v_row = in_row;
#endif
    v_uv = vec4(in_uv_front, in_uv_back);
    gl_Position = u_clip_from_local * vec4(in_position, 1.0);
}
