// A scene before there is any light: its triangles in the colours of their materials.
uniform mat4 u_clip_from_local;

in vec3 in_position;  // solver space
in vec3 in_colour;    // linear Rec.709

out vec3 v_position;
out vec3 v_colour;

void main() {
    v_position = in_position;
    v_colour = in_colour;
    gl_Position = u_clip_from_local * vec4(in_position, 1.0);
}
