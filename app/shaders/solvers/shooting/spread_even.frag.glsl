// The even ambient term of every texel as it is now: so that light which then arrives in some texels, not yet in others, is taken off
// in those alone.
#include "common/even_ambient.glsl"

uniform sampler2D t_irradiance;
uniform sampler2D t_to_come;  // see to_come.frag.glsl

layout(location = 0) out vec4 out_ambient;  // see common/ambient.glsl

void main() {
    vec3 H = texelFetch(t_irradiance, ivec2(gl_FragCoord.xy), 0).rgb;
    out_ambient = vec4(even_ambient(t_to_come, H), -max(dot(H, vec3(1.0)), 1e-30));
}
