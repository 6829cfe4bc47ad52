// What gather points receive of light that is unshot on the surfaces which they see, and of what these will reflect:
//
//   a = 1/N Σ_k (r + ρ a)(hit_k)
//
// What lamps have yet to shoot is left out: few rays would find them. See to_come.frag.glsl.
#include "common/albedo.glsl"
#include "common/ambient.glsl"
#include "solvers/shooting/gather_point.glsl"
#include "visibility/hit.glsl"
#define RAY_EDGE  // rays of a point along the edge of its square

uniform usampler2D t_hits;
uniform sampler2D t_residual;
uniform sampler2D t_materials;

layout(location = 0) out vec4 out_ambient;  // a: the chart of the point, from 1; 0 where none is

void main() {
    ivec2 block = ivec2(gl_FragCoord.xy);
    Texel texel = gather_point(block);
    out_ambient = vec4(0.0);
    if (texel.area <= 0.0) return;
    for (int k = 0; k < RAY_EDGE * RAY_EDGE; ++k) {
        ivec2 px = texel_px_of(texelFetch(t_hits, block * RAY_EDGE + ivec2(k % RAY_EDGE, k / RAY_EDGE), 0).x);
        if (px.y >= u_rows) continue;
        uint material = material_from_ids(texelFetch(t_normal_ids, px, 0).y);
        vec3 E = texelFetch(t_materials, ivec2(1, int(material)), 0).rgb;
        out_ambient.rgb += albedo_of(t_materials, material, px) * ambient_at(px);
        if (E == vec3(0.0)) out_ambient.rgb += texelFetch(t_residual, px, 0).rgb;
    }
    out_ambient = vec4(out_ambient.rgb / float(RAY_EDGE * RAY_EDGE), 1.0 + chart_of(texel.facet));
}
