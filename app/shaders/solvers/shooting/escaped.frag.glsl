// This sums how much of what the shooters send out escapes from the scene (r), or ends on black sides without texels (g), in
// pieces: each texel sums the weights of such samples in one block of the map. The four in the middle of every 4×4 samples stand
// for these.
#include "common/item.glsl"
#define BLOCK 8

const int STRIDE = 4;

uniform sampler2D t_items;
uniform sampler2D t_weights;  // what each of those four stands for, see weights.frag.glsl
uniform int u_row;            // of the target, where the blocks of the first map begin

layout(location = 0) out vec2 out_escaped;

void main() {
    ivec2 corner_px = (ivec2(gl_FragCoord.xy) - ivec2(0, u_row)) * BLOCK;
    int height = textureSize(t_weights, 0).y;
    vec2 px_to_uv = 1.0 / vec2(textureSize(t_items, 0));
    vec2 sum = vec2(0.0);
    for (int j = 0; j < BLOCK; j += STRIDE)
        for (int i = 0; i < BLOCK; i += STRIDE) {
            ivec2 px = corner_px + ivec2(i, j), quad = px / STRIDE;
            vec4 weights = texelFetch(t_weights, ivec2(quad.x, quad.y % height), 0);
            vec4 items = textureGather(t_items, vec2(px + STRIDE / 2) * px_to_uv);
            sum += vec2(dot(weights, vec4(equal(items, vec4(OPEN)))), dot(weights, vec4(equal(items, vec4(UNCHARTED)))));
        }
    out_escaped = sum;
}
