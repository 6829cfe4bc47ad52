// Irradiance at points of the atlas, one per pixel, bilinear among the texels that cover a surface, as it is drawn.
#include "common/pages.glsl"
#include "common/tile.glsl"
uniform sampler2D t_points;  // uv [texels of level 0]
uniform sampler2D t_position_area;
uniform sampler2D t_irradiance;
uniform float u_unit;  // W/m² per stored unit

layout(location = 0) out vec4 out_irradiance;  // H [W/m²]; w: 0 where no texel is near

vec4 texel_at(vec2 uv) {
    ivec2 slot = slot_at(uv);
    if (slot.y < 0) return vec4(0.0);
    vec3 leaf = texelFetch(t_leaves, slot, 0).xyz;
    ivec2 px = slot * TILE + clamp(ivec2(floor(uv / leaf.z - leaf.xy * float(TILE))), 0, TILE - 1);
    bool covered = texelFetch(t_position_area, px, 0).w > 0.0;
    return covered ? vec4(texelFetch(t_irradiance, px, 0).rgb * u_unit, 1.0) : vec4(0.0);
}

void main() {
    vec2 uv = texelFetch(t_points, ivec2(gl_FragCoord.xy), 0).xy;
    ivec2 slot = slot_at(uv);
    float texel = slot.y < 0 ? 1.0 : texelFetch(t_leaves, slot, 0).z;
    vec2 low = floor(uv / texel - 0.5), share = uv / texel - 0.5 - low;
    vec4 sum = vec4(0.0), near = vec4(0.0);
    for (int i = 0; i < 4; ++i) {
        ivec2 step = ivec2(i & 1, i >> 1);
        vec4 here = texel_at((low + vec2(step) + 0.5) * texel);
        vec2 weight = mix(1.0 - share, share, vec2(step));
        sum += weight.x * weight.y * here;
        near += here;
    }
    out_irradiance = sum.w > 1e-3 ? sum / sum.w : near / max(near.w, 1.0);
}
