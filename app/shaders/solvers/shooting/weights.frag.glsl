// The weights are delta form factors of the map's samples, summed over every 4×4 of them and shared out among those of the four
// in their middle that lie on the hemisphere, for escaped.frag.glsl. Where none does, a corner of the rim is left out: in all
// 3e-5 of the hemisphere at R = 64, 4e-6 at 256.
#include <projection>
#define LIGHT 0  // 1: solid angles instead, of what shines to all sides alike

const int STRIDE = 4;

layout(location = 0) out vec4 out_weights;  // in the order of textureGather

void main() {
    ivec2 corner_px = STRIDE * ivec2(gl_FragCoord.xy);
    float sum = 0.0;
    for (int j = 0; j < STRIDE; ++j)
        for (int i = 0; i < STRIDE; ++i) {
            vec2 px = vec2(corner_px + ivec2(i, j)) + 0.5;
            int view = view_from_px(px);
#if LIGHT
            vec3 sight = local_from_view(view, sight_from_px(view, px));
            if (sight.z > 0.0) sum += delta_form_factor(view, px) * 3.14159265358979 * length(sight) / sight.z;
#else
            sum += delta_form_factor(view, px);
#endif
        }
    vec4 on = on_hemisphere(vec2(corner_px + STRIDE / 2));
    out_weights = sum * on / max(dot(on, vec4(1.0)), 1.0);
}
