// Colour times texture: glyphs, shapes and images alike.
in vec2 v_uv;
in vec4 v_colour;

uniform sampler2D t_image;

layout(location = 0) out vec4 out_colour;

void main() {
    out_colour = v_colour * texture(t_image, v_uv);
}
