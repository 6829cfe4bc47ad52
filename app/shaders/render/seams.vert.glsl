// Display texels near a seam, one instance each.
uniform vec2 u_size;  // display texels

in vec2 in_texel;   // display texel
in vec2 in_other;   // where in the atlas its surface goes on [texels of level 0]
in float in_weight;  // of what is there

flat out vec2 v_other;
flat out float v_weight;

void main() {
    vec2 at = in_texel + vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(at / u_size * 2.0 - 1.0, 0.0, 1.0);
    v_other = in_other;
    v_weight = in_weight;
}
