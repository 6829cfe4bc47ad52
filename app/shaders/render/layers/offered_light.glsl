// Light that a solver offers of every texel, as the radiance that a white surface would have of it.
#include "common/atlas.glsl"
uniform sampler2D t_offered;
uniform float u_unit;  // W/m² per stored unit

vec3 layer_colour(ivec2 texel_px) { return texelFetch(t_offered, texel_px, 0).rgb * (u_unit / PI); }

vec3 unlit_colour(int material) { return vec3(0.0); }
