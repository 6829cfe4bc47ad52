// The ambient light of a texel: about the irradiance that it will still receive, see app/solvers/shooting/ambient.py. Where less
// light is to be there than was shot, residual and ambient are negative.
//
// Where each texel has its own, that is gathered anew now and then. What has arrived since it was last gathered is taken off, or
// would be shown twice.
#include "common/even_ambient.glsl"

uniform sampler2D t_ambient;  // irradiance, stored units; of each texel (w: -(Σ H then), 0: as it is), or an even one of 3×1

// H: irradiance of the texel now
vec3 ambient_at(ivec2 texel_px, vec3 H) {
    if (textureSize(t_ambient, 0).y == 1) return even_ambient(t_ambient, H);
    vec4 a = texelFetch(t_ambient, texel_px, 0);
    float all = dot(a.rgb, vec3(1.0)), since = dot(H, vec3(1.0)) + a.w;
    return a.rgb * (a.w < 0.0 && all != 0.0 ? clamp(1.0 - since / all, 0.0, 1.0) : 1.0);
}
