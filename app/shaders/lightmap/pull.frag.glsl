// The light of children onto the leaf that replaces them: means over area, which keep all energy.
uniform sampler2D t_lifted_irradiance;
uniform sampler2D t_lifted_residual;
uniform sampler2D t_lifted_area;

flat in vec2 v_corner;
flat in vec2 v_from;

layout(location = 0) out vec4 out_irradiance;
layout(location = 1) out vec4 out_residual;

void main() {
    ivec2 first = ivec2(v_from + 2.0 * floor(gl_FragCoord.xy - v_corner));
    out_irradiance = out_residual = vec4(0.0);
    float area = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 px = first + ivec2(k & 1, k >> 1);
        float own = texelFetch(t_lifted_area, px, 0).r;
        out_irradiance += own * texelFetch(t_lifted_irradiance, px, 0);
        out_residual += own * texelFetch(t_lifted_residual, px, 0);
        area += own;
    }
    out_irradiance /= max(area, 1e-37);
    out_residual /= max(area, 1e-37);
}
