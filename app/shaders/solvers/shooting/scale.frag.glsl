// Multiplies light that is there, H and r: it is linear in what emits it. Blended.
uniform vec4 u_factor;

layout(location = 0) out vec4 out_irradiance;
layout(location = 1) out vec4 out_residual;

void main() { out_irradiance = out_residual = u_factor; }
