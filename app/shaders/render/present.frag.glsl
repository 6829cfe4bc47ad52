// The mean of pictures that were added as light, for the screen.
#include "common/colour.glsl"
#define LINEAR 0  // as light
uniform sampler2D t_sum;
uniform float u_share;  // of each of them

layout(location = 0) out vec4 out_colour;

void main() {
    vec3 colour = texelFetch(t_sum, ivec2(gl_FragCoord.xy), 0).rgb * u_share;
#if !LINEAR
    colour = encode_srgb(colour);
#endif
    out_colour = vec4(colour, 1.0);
}
