// The local set around the observer: a colour for the level of each patch and cluster, shaded a little one by one, white while it has
// just entered; grey outside of the set.
#include "render/level_colour.glsl"
uniform sampler2D t_offered;  // level from 1, 0 in none; pieces of work since it entered; the number of its colour

const float GOLDEN = 0.61803399;  // its steps keep neighbours in the numbering apart
const float NEW = 8.0;            // pieces of work, until it is old

vec3 layer_colour(ivec2 texel_px) {
    vec3 mark = texelFetch(t_offered, texel_px, 0).rgb;
    if (mark.r < 0.5) return vec3(0.12);
    vec3 colour = 0.8 * level_colour(mark.r - 1.0) * (0.75 + 0.25 * fract(mark.b * GOLDEN));
    return mix(vec3(1.0), colour, min(mark.g / NEW, 1.0));
}

vec3 unlit_colour(int material) { return vec3(0.0); }
