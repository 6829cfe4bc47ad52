// Rectangles of texels, one instance each.
uniform vec2 u_size;  // of the target [texels]

in vec4 in_rect;  // corner and size in the target [texels]
in vec2 in_from;  // where its first texel comes from [texels]

flat out vec2 v_corner;
flat out vec2 v_from;

void main() {
    vec2 at = in_rect.xy + in_rect.zw * vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(at / u_size * 2.0 - 1.0, 0.0, 1.0);
    v_corner = in_rect.xy;
    v_from = in_from;
}
