// Neutral dark, slightly lighter towards the top; a little noise hides the steps of 8 bits. [Jimenez14]
uniform float u_height_px;

layout(location = 0) out vec4 out_colour;

void main() {
    float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)))) - 0.5;
    vec3 encoded = mix(vec3(0.092, 0.095, 0.101), vec3(0.166, 0.17, 0.18), gl_FragCoord.y / u_height_px);
    out_colour = vec4(encoded + noise / 255.0, 1.0);
}
