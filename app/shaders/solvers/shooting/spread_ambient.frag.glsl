// The ambient light of every texel: what the gather points of its chart around it receive, bilinear, and what lamps and
// sources outside have yet to give.
#include "solvers/shooting/around.glsl"
#include "solvers/shooting/block.glsl"
#include "common/even_ambient.glsl"

uniform usampler2D t_around;
uniform sampler2D t_gathered;  // of gather points, see smooth_ambient.frag.glsl: a is 0 of those that have not looked yet
uniform sampler2D t_irradiance;
uniform sampler2D t_to_come;   // see to_come.frag.glsl

layout(location = 0) out vec4 out_ambient;  // see common/ambient.glsl

#define FORESEEN 0  // whether what they receive was found elsewhere, and all of it is still to come

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    uvec4 around = texelFetch(t_around, px, 0);
    out_ambient = vec4(0.0);
    if (around.x == NO_TEXEL) return;
    vec3 H = texelFetch(t_irradiance, px, 0).rgb;
    vec2 share = fract((vec2(px) + 0.5) / float(BLOCK) - 0.5);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; ++i) {
        vec2 weight = mix(1.0 - share, share, vec2(i & 1, i >> 1));
        uint point = around[i];
        vec4 one = texelFetch(t_gathered, ivec2(point & 0xFFFFu, point >> 16) * int(point != NO_POINT), 0);
        sum += weight.x * weight.y * float(point != NO_POINT && one.a > 0.0) * vec4(one.rgb, 1.0);
    }
    vec4 own = texelFetch(t_gathered, px / BLOCK, 0);
    vec3 gathered = texelFetch(t_to_come, ivec2(0), 0).rgb;  // no point around has looked yet
    if (sum.a > 0.0) gathered = sum.rgb / sum.a;
    // a piece of a chart beside the gather point of another one: that sees other things
    else if (own.a > 0.0) gathered = FORESEEN == 1 ? own.rgb : clamp(own.rgb, -abs(H), abs(H));
    out_ambient = vec4(max(gathered + from_sources(t_to_come, H), -abs(H)), -max(dot(H, vec3(1.0)), 1e-30));
}
