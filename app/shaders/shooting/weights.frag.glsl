// Delta form factors of the map's samples, summed over every 4×4 of them for open.frag.glsl.
#include <projection>

const int STRIDE = 4;

layout(location = 0) out float out_weight;

void main() {
    ivec2 corner_px = STRIDE * ivec2(gl_FragCoord.xy);
    out_weight = 0.0;
    for (int j = 0; j < STRIDE; ++j)
        for (int i = 0; i < STRIDE; ++i) {
            vec2 px = vec2(corner_px + ivec2(i, j)) + 0.5;
            out_weight += delta_form_factor(view_from_px(px), px);
        }
}
