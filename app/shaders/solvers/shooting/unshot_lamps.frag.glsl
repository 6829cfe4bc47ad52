// Adds up what the texels of lamps have yet to shoot, and its absolute values over blocks. Blended.
flat in vec3 v_unshot;

layout(location = 0) out vec4 out_unshot;

void main() { out_unshot = vec4(v_unshot, dot(abs(v_unshot), vec3(1.0))); }
