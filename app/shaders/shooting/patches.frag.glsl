// Residual power of each patch, |Σ r·A| [stored units · solver area], summed over RGB: one texel per patch of 2^level texels. Less
// light than was shot is a negative residual, and is shot like any other [Chen90].
#define LEVEL 2

uniform sampler2D t_position_area;
uniform sampler2D t_residual;

layout(location = 0) out float out_power;

void main() {
    ivec2 corner_px = ivec2(gl_FragCoord.xy) << LEVEL;
    vec3 power = vec3(0.0);
    for (int j = 0; j < (1 << LEVEL); ++j)
        for (int i = 0; i < (1 << LEVEL); ++i) {
            ivec2 texel_px = corner_px + ivec2(i, j);
            power += texelFetch(t_residual, texel_px, 0).rgb * texelFetch(t_position_area, texel_px, 0).w;
        }
    out_power = dot(abs(power), vec3(1.0));
}
