// Sums of blocks of a row; the host adds up those of each row.
#define BLOCK 16

uniform sampler2D t_samples;

layout(location = 0) out vec4 out_sum;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    out_sum = vec4(0.0);
    for (int k = 0; k < BLOCK; ++k) out_sum += texelFetch(t_samples, ivec2(px.x * BLOCK + k, px.y), 0);
}
