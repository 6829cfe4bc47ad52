// A triangle over the half of the matrix on its diagonal and below: in each row, the columns up to it. It is a little larger, so that
// the middles of the texels on the diagonal are in it.
uniform float u_texel;  // over the edge of the matrix

void main() {
    float more = 2.0 * u_texel;
    vec2 corner = gl_VertexID == 0 ? vec2(0.0, -more) : gl_VertexID == 1 ? vec2(0.0, 1.0 + more) : vec2(1.0 + 2.0 * more, 1.0 + more);
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}
