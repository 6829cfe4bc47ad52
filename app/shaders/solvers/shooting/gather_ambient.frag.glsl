// What gather points receive of what the surfaces which they see have yet to pass on, the mean over their rays.
//
// What is small and bright, the inside of a lamp's shade, is found by one ray of a point or two, and by none of its neighbours:
// spots. So the two brightest rays count for no more than an eighth each of what the others find, or of the even ambient term.
#include "solvers/shooting/gather_point.glsl"
#include "solvers/shooting/ray_of_point.glsl"
#include "visibility/hit.glsl"

uniform usampler2D t_hits;
uniform sampler2D t_to_pass_on;
uniform sampler2D t_even;  // one texel, see even_ambient.frag.glsl

layout(location = 0) out vec4 out_ambient;  // a: the chart of the point, from 1; 0 where none is

const float RAYS = float(RAY_EDGE * RAY_EDGE), MOST = RAYS / 8.0;

float strength(vec3 light) { return dot(abs(light), vec3(1.0)); }

void main() {
    ivec2 block = ivec2(gl_FragCoord.xy);
    Texel texel = gather_point(block);
    out_ambient = vec4(0.0);
    if (texel.area <= 0.0) return;
    vec3 sum = vec3(0.0), brightest = vec3(0.0), second = vec3(0.0);
    for (int ray = 0; ray < RAY_EDGE * RAY_EDGE; ++ray) {
        ivec2 px = texel_px_of(texelFetch(t_hits, px_of_ray(block, ray), 0).x);
        if (px.y >= u_rows) continue;
        vec3 light = texelFetch(t_to_pass_on, px, 0).rgb;
        sum += light;
        if (strength(light) > strength(brightest)) {
            second = brightest;
            brightest = light;
        } else if (strength(light) > strength(second)) second = light;
    }
    sum -= brightest + second;
    float most = MOST * max(strength(sum) / (RAYS - 2.0), strength(texelFetch(t_even, ivec2(0), 0).rgb));
    sum += brightest * min(most / max(strength(brightest), 1e-30), 1.0);
    sum += second * min(most / max(strength(second), 1e-30), 1.0);
    out_ambient = vec4(sum / RAYS, 1.0 + chart_of(texel.facet));
}
