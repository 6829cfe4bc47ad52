// Border texels of leaves next to leaves of another level, so that both sides interpolate to the same light: no T-vertices.
// [Coombe03, 4.4]
//
// Next to a finer leaf, the mean g of the four texels that the border texel covers. Next to a coarser one, whose outermost texels lie
// at -1 and the leaf's own at 1/2 of its texels from the edge, the straight line through both at -1/2: g = f/3 + 2c/3. Where the
// light is linear, both sides then agree along the whole edge.
#include "common/atlas.glsl"
#include "common/pages.glsl"
#include "common/colour.glsl"
#include "render/display.glsl"
uniform sampler2D t_position_area;
uniform float u_gain;  // exposure

flat in vec2 v_outward;
flat in float v_finer;

layout(location = 0) out vec4 out_colour;

#include <layer>
#include <curve>

vec3 own_or(vec3 otherwise, ivec2 texel_px) {
    return texelFetch(t_position_area, texel_px, 0).w > 0.0 ? layer_colour(texel_px) : otherwise;
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy), slot = px / BORDERED;
    ivec2 inside = clamp(px - slot * BORDERED - 1, 0, TILE - 1);
    vec3 leaf = texelFetch(t_leaves, slot, 0).xyz;
    vec3 f = layer_colour(slot * TILE + inside);
    vec2 uv = (leaf.xy * float(TILE) + vec2(inside) + 0.5 + v_outward) * leaf.z;
    ivec2 other = slot_at(uv);
    vec3 near = texelFetch(t_leaves, max(other, 0), 0).xyz;
    vec2 at = uv / max(near.z, 1e-9) - near.xy * float(TILE);  // in the neighbour [its texels]
    vec3 colour = vec3(0.0);
    if (v_finer > 0.0) {
        ivec2 base = clamp(ivec2(round(at)) - 1, 0, TILE - 2);
        for (int k = 0; k < 4; ++k) colour += 0.25 * own_or(f, other * TILE + base + ivec2(k & 1, k >> 1));
    } else {
        vec2 along = vec2(1.0) - abs(v_outward);
        ivec2 row = clamp(ivec2(floor(at)), 0, TILE - 1);
        vec2 start = mix(vec2(row), clamp(at - 0.5, 0.0, float(TILE - 2)), along);
        float share = dot(clamp(at - 0.5 - floor(start), 0.0, 1.0), along);
        ivec2 first = other * TILE + ivec2(floor(start)), second = first + ivec2(along);
        vec3 c = mix(own_or(f, first), own_or(f, second), share);
        colour = f / 3.0 + c * 2.0 / 3.0;
    }
    out_colour = vec4(encode_srgb(develop(colour * u_gain)), 1.0);
}
