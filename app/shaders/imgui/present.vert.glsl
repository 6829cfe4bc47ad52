// One triangle that covers the viewport with an image. Sampled, this takes a software rasteriser three quarters of what it takes
// to fetch each texel.
out vec2 v_uv;

void main() {
    v_uv = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0;
    gl_Position = vec4(v_uv * 2.0 - 1.0, 0.0, 1.0);
}
