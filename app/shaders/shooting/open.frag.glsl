// Share of the shooter's sight that leaves the scene (r), and that ends on black sides without texels (g), in pieces: each texel
// sums the weights of such samples in one block of the map. Every other sample in both directions is enough.
#include "common/item.glsl"
#define BLOCK 32

const int STRIDE = 2;

uniform sampler2D t_map;
uniform sampler2D t_weights;  // delta form factors of the samples that are read; sum to 1
uniform ivec2 u_origin_px;    // of this shot's blocks in the target

layout(location = 0) out vec2 out_open;

void main() {
    ivec2 corner_px = (ivec2(gl_FragCoord.xy) - u_origin_px) * BLOCK;
    vec2 sum = vec2(0.0);
    for (int j = 0; j < BLOCK; j += STRIDE)
        for (int i = 0; i < BLOCK; i += STRIDE) {
            ivec2 px = corner_px + ivec2(i, j);
            float weight = texelFetch(t_weights, px / STRIDE, 0).r;
            float item = texelFetch(t_map, px, 0).r;
            sum += vec2(item == OPEN ? weight : 0.0, item == UNCHARTED ? weight : 0.0);
        }
    out_open = sum;
}
