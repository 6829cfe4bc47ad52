// A cell around each ray of a hemisphere that is seen from above, one instance each.
uniform float u_reach;  // of a cell, the disc's radius is 1

in vec2 in_place;  // in the disc
in vec3 in_light;

flat out vec3 v_light;
out vec2 v_offset;  // from the ray [reaches]
out vec2 v_place;

const float MARGIN = 1.02;  // around the disc

void main() {
    v_offset = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
    v_place = in_place + v_offset * u_reach;
    v_light = in_light;
    gl_Position = vec4(v_place / MARGIN, 0.0, 1.0);
}
