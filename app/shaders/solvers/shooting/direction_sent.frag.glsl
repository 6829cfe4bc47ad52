// How much of a map shows sides with texels, which its direction sends light to, in pieces: each texel counts the samples of one
// block. The four in the middle of every 4×4 samples stand for these.
#include "common/item.glsl"
#define BLOCK 8

const int STRIDE = 4;

uniform sampler2D t_items;
uniform int u_row;  // of the target, where the blocks of the first map begin

layout(location = 0) out float out_samples;

void main() {
    ivec2 corner_px = (ivec2(gl_FragCoord.xy) - ivec2(0, u_row)) * BLOCK;
    vec2 px_to_uv = 1.0 / vec2(textureSize(t_items, 0));
    vec4 shown = vec4(0.0);
    for (int j = 0; j < BLOCK; j += STRIDE)
        for (int i = 0; i < BLOCK; i += STRIDE) {
            vec4 items = textureGather(t_items, vec2(corner_px + ivec2(i, j) + STRIDE / 2) * px_to_uv);
            shown += vec4(notEqual(items, vec4(OPEN))) * vec4(notEqual(items, vec4(UNCHARTED)));
        }
    out_samples = dot(shown, vec4(STRIDE * STRIDE / 4));
}
