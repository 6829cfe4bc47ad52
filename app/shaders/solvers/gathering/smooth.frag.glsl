// The indirect light of every point, smoothed by as much as it is noisy: the mean over those points around whose pilot means differ
// from its own by no more than the noise of both. [Rousselle12]
#define RADIUS 4
#define DEVIATIONS 1.5
#include "solvers/gathering/window.glsl"

uniform sampler2D t_gathered;  // see gather.frag.glsl
uniform sampler2D t_pilot;     // see pilot.frag.glsl
uniform float u_rays;

layout(location = 0) out vec4 out_indirect;  // a: variance of the mean of RGB

vec2 own;
vec3 sum = vec3(0.0);
float count = 0.0;

void visit(ivec2 px) {
    vec2 other = texelFetch(t_pilot, px, 0).xy;
    float apart = other.x - own.x;
    if (apart * apart > DEVIATIONS * DEVIATIONS * (own.y + other.y)) return;
    sum += texelFetch(t_gathered, px, 0).rgb;
    count += 1.0;
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    own = texelFetch(t_pilot, px, 0).xy;
    out_indirect = walk(px) ? vec4(sum / (count * u_rays), own.y * 9.0 / count) : vec4(texelFetch(t_gathered, px, 0).rgb / u_rays, 0.0);
}
