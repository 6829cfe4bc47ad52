// The rendered view, pixel by pixel, into its place in the window.
uniform sampler2D t_image;
uniform ivec2 u_corner_px;  // lower left of the place in the target

layout(location = 0) out vec4 out_colour;

void main() {
    out_colour = vec4(texelFetch(t_image, ivec2(gl_FragCoord.xy) - u_corner_px, 0).rgb, 1.0);
}
