// Where leaves of different level meet: one instance for half an edge of a leaf, or for a corner; the border texels there.
uniform vec2 u_size;  // of the display texels

in vec4 in_rect;      // corner and size [display texels]
in vec3 in_from;      // column and row of its first texel; 1 where those that follow are above it, 0 where they are to the right

flat out vec2 v_corner;
flat out vec3 v_from;

void main() {
    vec2 at = in_rect.xy + in_rect.zw * vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(at / u_size * 2.0 - 1.0, 0.0, 1.0);
    v_corner = in_rect.xy;
    v_from = in_from;
}
