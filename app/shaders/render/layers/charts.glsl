// A colour per chart, shaded a little by facet.
#include "common/atlas.glsl"
uniform usampler2D t_normal_ids;
uniform usampler2D t_charts;  // chart of each facet

const float GOLDEN = 0.61803399;  // its steps keep neighbours in the numbering apart in hue

vec3 layer_colour(ivec2 texel_px) {
    uint facet = facet_from_ids(texelFetch(t_normal_ids, texel_px, 0).y);
    int width = textureSize(t_charts, 0).x;
    uint chart = texelFetch(t_charts, ivec2(int(facet) % width, int(facet) / width), 0).x;
    vec3 hue = 0.5 + 0.5 * cos(2.0 * PI * (fract(float(chart) * GOLDEN) + vec3(0.0, 1.0, 2.0) / 3.0));
    return mix(vec3(0.45), hue, 0.55) * (0.85 + 0.15 * fract(float(facet) * GOLDEN));
}

vec3 unlit_colour(int material) { return vec3(0.0); }
