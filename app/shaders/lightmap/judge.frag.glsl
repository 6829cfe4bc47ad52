// The judgement of a leaf, one texel per slot: (largest second difference of H, light Σ H A, area Σ A, share of texels in light).
//
// Where the gradient does not change, linear interpolation shows all there is, and more texels would show no more: the second
// difference is the jump of the gradient [Coombe03, 4.1; Vedel92]. H and not B = E + ρH: textures of albedo have texels of
// their own to be sharp in.
#include "common/tile.glsl"

uniform sampler2D t_position_area;
uniform sampler2D t_irradiance;  // a: Σ_i P_i F_ji V_ji
uniform sampler2D t_residual;    // a: Σ_i P_i F_ji

layout(location = 0) out vec4 out_roughness;

const float IN_LIGHT = 0.5;  // a texel that sees more than half of the light that it would get unoccluded

void main() {
    ivec2 corner_px = ivec2(gl_FragCoord.xy) * TILE;
    float roughest = 0.0, light = 0.0, area = 0.0, covered = 0.0, lit = 0.0;
    float below[TILE], under[TILE];  // H of the two rows below
    int column[TILE];                // covered texels below, without a gap
    for (int i = 0; i < TILE; ++i) column[i] = 0;
    for (int j = 0; j < TILE; ++j) {
        float before = 0.0, last = 0.0;   // H of the two texels to the left
        int run = 0;                      // covered texels to the left, without a gap
        for (int i = 0; i < TILE; ++i) {
            ivec2 px = corner_px + ivec2(i, j);
            float A = texelFetch(t_position_area, px, 0).w;
            vec4 h = texelFetch(t_irradiance, px, 0);
            float H = dot(h.rgb, vec3(1.0 / 3.0));
            bool here = A > 0.0;
            if (here && run >= 2) roughest = max(roughest, abs(before - 2.0 * last + H));
            run = here ? run + 1 : 0;
            before = last;
            last = H;
            if (here && column[i] >= 2) roughest = max(roughest, abs(under[i] - 2.0 * below[i] + H));
            column[i] = here ? column[i] + 1 : 0;
            under[i] = below[i];
            below[i] = H;
            light += H * A;
            area += A;
            covered += here ? 1.0 : 0.0;
            lit += here && h.a > IN_LIGHT * texelFetch(t_residual, px, 0).a ? 1.0 : 0.0;
        }
    }
    out_roughness = vec4(roughest, light, area, covered > 0.0 ? lit / covered : 1.0);
}
