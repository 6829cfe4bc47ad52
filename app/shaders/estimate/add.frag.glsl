// Sums of blocks of samples; the host adds up those of each map.
#define BLOCK 16

uniform sampler2D t_samples;

layout(location = 0) out vec4 out_sum;

void main() {
    ivec2 corner_px = ivec2(gl_FragCoord.xy) * BLOCK;
    out_sum = vec4(0.0);
    for (int k = 0; k < BLOCK * BLOCK; ++k)
        out_sum += texelFetch(t_samples, corner_px + ivec2(k % BLOCK, k / BLOCK), 0);
}
