// What gather points receive of what the surfaces which they see have yet to pass on, the mean over their rays.
#include "solvers/shooting/gather_point.glsl"
#include "solvers/shooting/ray_of_point.glsl"
#include "visibility/hit.glsl"

uniform usampler2D t_hits;
uniform sampler2D t_to_pass_on;

layout(location = 0) out vec4 out_ambient;  // a: the chart of the point, from 1; 0 where none is

void main() {
    ivec2 block = ivec2(gl_FragCoord.xy);
    Texel texel = gather_point(block);
    out_ambient = vec4(0.0);
    if (texel.area <= 0.0) return;
    for (int ray = 0; ray < RAY_EDGE * RAY_EDGE; ++ray) {
        ivec2 px = texel_px_of(texelFetch(t_hits, px_of_ray(block, ray), 0).x);
        if (px.y < u_rows) out_ambient.rgb += texelFetch(t_to_pass_on, px, 0).rgb;
    }
    out_ambient = vec4(out_ambient.rgb / float(RAY_EDGE * RAY_EDGE), 1.0 + chart_of(texel.facet));
}
