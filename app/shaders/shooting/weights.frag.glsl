// Delta form factors of the map's samples that open.frag.glsl reads: every other one, standing for its block of four.
#include <projection>

const int STRIDE = 2;

layout(location = 0) out float out_weight;

void main() {
    ivec2 corner_px = STRIDE * ivec2(gl_FragCoord.xy);
    out_weight = 0.0;
    for (int k = 0; k < STRIDE * STRIDE; ++k) {
        vec2 px = vec2(corner_px + ivec2(k & 1, k >> 1)) + 0.5;
        out_weight += delta_form_factor(view_from_px(px), px);
    }
}
