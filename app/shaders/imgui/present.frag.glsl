// The rendered view, pixel by pixel, into its place in the window.
in vec2 v_uv;

uniform sampler2D t_image;

layout(location = 0) out vec4 out_colour;

void main() { out_colour = vec4(textureLod(t_image, v_uv, 0.0).rgb, 1.0); }
