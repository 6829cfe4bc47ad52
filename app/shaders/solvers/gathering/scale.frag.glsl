// One factor for all texels, RGB. Blended: multiplied.
uniform vec3 u_factor;

layout(location = 0) out vec4 out_factor;

void main() { out_factor = vec4(u_factor, 1.0); }
