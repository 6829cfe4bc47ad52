// A picture of the screen as light, to be added to others.
#include "common/colour.glsl"
#define LINEAR 0  // it is of light already
uniform sampler2D t_picture;

layout(location = 0) out vec4 out_colour;

void main() {
    vec3 colour = texelFetch(t_picture, ivec2(gl_FragCoord.xy), 0).rgb;
#if !LINEAR
    colour = decode_srgb(colour);
#endif
    out_colour = vec4(colour, 1.0);
}
