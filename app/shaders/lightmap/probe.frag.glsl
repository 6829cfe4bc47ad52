// Irradiance at points of the atlas, with what is still to come, one per pixel, bilinear. Texels that cover nothing repeat their
// nearest neighbour, as in a bake.
#include "common/ambient.glsl"
#include "common/texel_at.glsl"
uniform sampler2D t_points;  // uv [texels of level 0]
uniform sampler2D t_position_area;
uniform sampler2D t_irradiance;
uniform float u_unit;  // W/m² per stored unit

layout(location = 0) out vec4 out_irradiance;  // H + a [W/m²]; w: 0 where no texel is near

// Nearest first, in the order of app/bake/gutter.py: u, v
const vec2 NEIGHBOURS[9] = vec2[](
    vec2(0, 0), vec2(0, -1), vec2(-1, 0), vec2(1, 0), vec2(0, 1), vec2(-1, -1), vec2(1, -1), vec2(-1, 1), vec2(1, 1));

vec4 texel_at(vec2 uv) {
    ivec2 px = texel_px_at(uv);
    if (px.y < 0) return vec4(0.0);
    bool covered = texelFetch(t_position_area, px, 0).w > 0.0;
    vec3 H = texelFetch(t_irradiance, px, 0).rgb;
    return covered ? vec4((H + ambient_at(px, H)) * u_unit, 1.0) : vec4(0.0);
}

vec4 filled(vec2 uv, float texel) {
    vec4 found = vec4(0.0);
    for (int i = 0; i < 9 && found.w == 0.0; ++i) found = texel_at(uv + NEIGHBOURS[i] * texel);
    return found;
}

void main() {
    vec2 uv = texelFetch(t_points, ivec2(gl_FragCoord.xy), 0).xy;
    ivec2 slot = slot_at(uv);
    float texel = slot.y < 0 ? 1.0 : texelFetch(t_leaves, slot, 0).z;
    vec2 low = floor(uv / texel - 0.5), share = uv / texel - 0.5 - low;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; ++i) {
        vec2 corner = vec2(i & 1, i >> 1), weight = mix(1.0 - share, share, corner);
        sum += weight.x * weight.y * filled((low + corner + 0.5) * texel, texel);
    }
    out_irradiance = sum / max(sum.w, 1e-6);
}
