// A scene before there is any light: its triangles in the colours of their materials.
uniform mat4 u_clip_from_local;

in vec3 in_position;  // solver space
in vec3 in_tint;
in float in_material;
uniform sampler2D t_colours;  // of materials, row by row, linear Rec.709

out vec3 v_position;
out vec3 v_colour;

void main() {
    v_position = in_position;
    int material = int(in_material), width = textureSize(t_colours, 0).x;
    v_colour = in_tint * texelFetch(t_colours, ivec2(material % width, material / width), 0).rgb;
    gl_Position = u_clip_from_local * vec4(in_position, 1.0);
}
