// The ambient light of every texel: what the gather points of its chart around it receive, bilinear, and what lamps and
// sources outside have yet to give.
#include "common/texel_at.glsl"
#include "solvers/shooting/gather_point.glsl"

uniform sampler2D t_gathered;  // of gather points
uniform sampler2D t_irradiance;
uniform sampler2D t_to_come;   // see to_come.frag.glsl

layout(location = 0) out vec4 out_ambient;

ivec2 block_at(ivec2 block, ivec2 slot) {
    const int ACROSS = TILE / BLOCK;
    if (all(greaterThanEqual(block, ivec2(0))) && all(lessThan(block, ivec2(ACROSS)))) return slot * ACROSS + block;
    vec3 leaf = texelFetch(t_leaves, slot, 0).xyz;
    ivec2 px = texel_px_at((leaf.xy * float(TILE) + (vec2(block) + 0.5) * float(BLOCK)) * leaf.z);
    return px.y < 0 ? ivec2(-1) : px / BLOCK;
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy), slot = px / TILE;
    Texel texel = load_texel(t_position_area, t_normal_ids, px);
    out_ambient = vec4(0.0);
    if (texel.area <= 0.0) return;
    vec3 H = texelFetch(t_irradiance, px, 0).rgb;
    vec2 at = (vec2(px - slot * TILE) + 0.5) / float(BLOCK) - 0.5, low = floor(at), share = at - low;
    float chart = 1.0 + chart_of(texel.facet);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; ++i) {
        ivec2 corner = ivec2(i & 1, i >> 1), block = block_at(ivec2(low) + corner, slot);
        if (block.y < 0) continue;
        vec2 weight = mix(1.0 - share, share, vec2(corner));
        vec4 one = texelFetch(t_gathered, block, 0);
        if (one.a == chart) sum += weight.x * weight.y * vec4(one.rgb, 1.0);
    }
    // a piece of a chart beside the gather point of another one: that sees other things
    vec3 gathered = sum.a > 0.0 ? sum.rgb / sum.a : clamp(texelFetch(t_gathered, px / BLOCK, 0).rgb, -abs(H), abs(H));
    vec3 direct = texelFetch(t_to_come, ivec2(0), 0).rgb * H, most = texelFetch(t_to_come, ivec2(1, 0), 0).rgb;
    out_ambient = vec4(max(gathered + clamp(direct, -most, most), -abs(H)), 0.0);
}
