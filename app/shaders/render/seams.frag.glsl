// The layer on display texels near a seam, where it fades from one chart to the other, see app/atlas/seams.py.
#include "common/colour.glsl"
#include "common/texel_at.glsl"
#include "render/display.glsl"
uniform usampler2D t_source;
uniform sampler2D t_position_area;
uniform float u_gain;  // exposure

flat in vec2 v_other;
flat in float v_weight;

layout(location = 0) out vec4 out_colour;

#include <layer>
#include <curve>
#include "render/shown.glsl"

// Bilinear among the texels that cover something; w: their weight.
vec4 layer_at(vec2 uv) {
    ivec2 slot = slot_at(uv);
    if (slot.y < 0) return vec4(0.0);
    float texel = texelFetch(t_leaves, slot, 0).z;
    vec2 low = floor(uv / texel - 0.5), share = uv / texel - 0.5 - low;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; ++i) {
        vec2 corner = vec2(i & 1, i >> 1), weight = mix(1.0 - share, share, corner);
        ivec2 px = texel_px_at((low + corner + 0.5) * texel);
        if (px.y >= 0 && texelFetch(t_position_area, px, 0).w > 0.0)
            sum += weight.x * weight.y * vec4(layer_colour(px), 1.0);
    }
    return vec4(sum.rgb / max(sum.w, 1e-6), sum.w);
}

void main() {
    uint source = texelFetch(t_source, ivec2(gl_FragCoord.xy), 0).x;
    if (source == NO_SOURCE) discard;
    vec3 own = layer_colour(ivec2(source & 0xFFFFu, source >> 16));
    vec4 other = layer_at(v_other);
    vec3 colour = mix(own, other.rgb, other.w > 0.0 ? v_weight : 0.0);
    out_colour = vec4(shown(colour * u_gain), 1.0);
}
