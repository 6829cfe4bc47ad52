// The finished picture into the caller's target; several samples per pixel are averaged as light.
#include "common/colour.glsl"
#define SAMPLES 1
uniform sampler2D t_picture;

layout(location = 0) out vec4 out_colour;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy) * SAMPLES;
#if SAMPLES == 1
    out_colour = texelFetch(t_picture, px, 0);
#else
    vec3 sum = vec3(0.0);
    for (int y = 0; y < SAMPLES; ++y)
        for (int x = 0; x < SAMPLES; ++x) sum += decode_srgb(texelFetch(t_picture, px + ivec2(x, y), 0).rgb);
    out_colour = vec4(encode_srgb(sum / float(SAMPLES * SAMPLES)), 1.0);
#endif
}
