// Where the light of a tile goes, one texel per slot: what it absorbs, Σ (1 - ρ) H A, and what of the light that it sends out leaves
// the scene or ends on black sides, Σ B A times the share of its rays that do; RGB, stored units. a: Σ A.
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "common/exitance.glsl"
#include "common/tile.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_direct;
uniform sampler2D t_indirect;
uniform sampler2D t_lost;
uniform float u_unit;  // W/m² per stored unit
uniform float u_rays;

layout(location = 0) out vec4 out_absorbed;
layout(location = 1) out vec4 out_escaped;
layout(location = 2) out vec4 out_blackened;
layout(location = 3) out vec4 out_reflectance;  // Σ ρ A

void main() {
    ivec2 corner_px = ivec2(gl_FragCoord.xy) * TILE;
    out_absorbed = out_escaped = out_blackened = out_reflectance = vec4(0.0);
    for (int i = 0; i < TILE * TILE; ++i) {
        ivec2 px = corner_px + ivec2(i % TILE, i / TILE);
        float A = texelFetch(t_position_area, px, 0).w;
        if (A <= 0.0) continue;
        uint material = material_from_ids(texelFetch(t_normal_ids, px, 0).y);
        vec3 H = texelFetch(t_direct, px, 0).rgb + texelFetch(t_indirect, px, 0).rgb;
        vec3 rho = albedo_of(t_materials, material, px);
        vec3 B = exitance_of(t_materials, material, px) / u_unit + rho * H;
        vec2 lost = texelFetch(t_lost, px, 0).rg / u_rays;
        out_absorbed += A * vec4((1.0 - rho) * H, 1.0);
        out_escaped.rgb += A * B * lost.r;
        out_blackened.rgb += A * B * lost.g;
        out_reflectance.rgb += A * rho;
    }
}
