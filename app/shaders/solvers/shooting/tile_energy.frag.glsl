// The energy on one tile is, in solver area: absorbed Σ (1-ρ) H A, unshot Σ r A, and Σ ρ A for the ambient term.
#include "common/atlas.glsl"
#include "common/tile.glsl"
#include "common/albedo.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_irradiance;
uniform sampler2D t_residual;

layout(location = 0) out vec4 out_absorbed;   // a: Σ A
layout(location = 1) out vec4 out_unshot;
layout(location = 2) out vec4 out_reflectance;

void main() {
    ivec2 corner_px = ivec2(gl_FragCoord.xy) * TILE;
    out_absorbed = out_unshot = out_reflectance = vec4(0.0);
    for (int k = 0; k < TILE * TILE; ++k) {
        ivec2 px = corner_px + ivec2(k % TILE, k / TILE);
        Texel texel = load_texel(t_position_area, t_normal_ids, px);
        if (texel.area <= 0.0) continue;
        vec3 rho = albedo_of(t_materials, texel.material, px);
        out_absorbed += vec4((1.0 - rho) * texelFetch(t_irradiance, px, 0).rgb, 1.0) * texel.area;
        out_unshot.rgb += texelFetch(t_residual, px, 0).rgb * texel.area;
        out_reflectance.rgb += rho * texel.area;
    }
}
