// One triangle that covers the viewport, just before the far plane: it fills what the surfaces leave.
void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(corner * 4.0 - 1.0, 1.0 - 1e-6, 1.0);
}
