// What is about right around each point: the mean of gathered light over 3×3 points, and the variance of that mean. The variance of
// all of them is taken as alike: one by itself that has missed what is bright is too dark, and seems sure of it.
#define RADIUS 1
#include "solvers/gathering/window.glsl"

uniform sampler2D t_gathered;  // see gather.frag.glsl
uniform float u_rays;

layout(location = 0) out vec2 out_pilot;  // of the mean of RGB

const float GROUP = 4.0;  // rays, see gather.frag.glsl

float count = 0.0;

void visit(ivec2 px) {
    vec4 g = texelFetch(t_gathered, px, 0);
    float groups = u_rays / GROUP, mean = dot(g.rgb, vec3(1.0 / 3.0)) / u_rays;
    out_pilot += vec2(mean, max(g.a / (GROUP * GROUP * groups) - mean * mean, 0.0) / max(groups - 1.0, 1.0));
    count += 1.0;
}

void main() {
    out_pilot = vec2(0.0);
    if (walk(ivec2(gl_FragCoord.xy))) out_pilot /= vec2(count, count * count);
}
