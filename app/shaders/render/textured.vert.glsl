// Triangles of materials with textures, once more.
uniform mat4 u_clip_from_local;

in vec3 in_position;
in vec2 in_uv_front;
in vec2 in_uv_back;
in vec2 in_albedo_uv;
in vec2 in_emission_uv;
in vec3 in_colour;

out vec4 v_uv;  // atlas texels: front, back; negative without texels
out vec2 v_albedo_uv;
out vec2 v_emission_uv;
out vec3 v_colour;
invariant gl_Position;  // at the depth of render/surfaces

void main() {
    v_uv = vec4(in_uv_front, in_uv_back);
    v_albedo_uv = in_albedo_uv;
    v_emission_uv = in_emission_uv;
    v_colour = in_colour;
    gl_Position = u_clip_from_local * vec4(in_position, 1.0);
}
