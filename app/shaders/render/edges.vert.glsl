// Half edges of leaves whose neighbour is of another level: one instance each, a row of eight border texels.
uniform vec2 u_size;  // of the display texels

in vec4 in_rect;      // corner and size [display texels]
in vec3 in_outward;   // towards the neighbour; its level less the leaf's own

flat out vec2 v_outward;
flat out float v_finer;

void main() {
    vec2 at = in_rect.xy + in_rect.zw * vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(at / u_size * 2.0 - 1.0, 0.0, 1.0);
    v_outward = in_outward.xy;
    v_finer = in_outward.z;
}
