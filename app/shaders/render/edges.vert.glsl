// Half edges and corners of leaves whose neighbour is of another level: one instance each, the border texels there.
uniform vec2 u_size;  // of the display texels

in vec4 in_rect;      // corner and size [display texels]
in vec2 in_outward;   // towards the neighbour: -1, 0 or 1, both not 0 at a corner

flat out vec2 v_outward;

void main() {
    vec2 at = in_rect.xy + in_rect.zw * vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(at / u_size * 2.0 - 1.0, 0.0, 1.0);
    v_outward = in_outward;
}
