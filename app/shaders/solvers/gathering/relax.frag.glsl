// One step of the Chebyshev semi-iteration [Golub61], blended over the solution before the last one:
//
//   H' = ω (direct + Σ B / N) + (1 - ω) H_before
uniform sampler2D t_direct;
uniform sampler2D t_gathered;
uniform float u_rays;
uniform float u_omega;

layout(location = 0) out vec4 out_solution;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    vec3 H = texelFetch(t_direct, px, 0).rgb + texelFetch(t_gathered, px, 0).rgb / u_rays;
    out_solution = vec4(u_omega * H, 1.0 - u_omega);
}
