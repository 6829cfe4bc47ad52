// One vertex of the user interface: display units, origin at the top left.
layout(location = 0) in vec2 in_position;
layout(location = 1) in vec2 in_uv;
layout(location = 2) in vec4 in_colour;

uniform vec4 u_clip_from_display;  // scale, offset

out vec2 v_uv;
out vec4 v_colour;

void main() {
    v_uv = in_uv;
    v_colour = in_colour;
    gl_Position = vec4(in_position * u_clip_from_display.xy + u_clip_from_display.zw, 0.0, 1.0);
}
