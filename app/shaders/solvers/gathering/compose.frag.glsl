// The light that is shown: H = direct + indirect. Texels that are finer than points interpolate among those of their chart that no
// wall parts from the one they lie in.
#define FINER 0
#include "common/atlas.glsl"
#include "common/texel_at.glsl"

uniform sampler2D t_direct;    // a: variance of the mean of RGB
uniform sampler2D t_indirect;  // of points; a: variance of the mean of RGB
#if FINER
uniform sampler2D t_own_leaves;
uniform usampler2D t_own_normal;  // and the chart
uniform usampler2D t_origin_normal;
uniform sampler2D t_walls;  // see walls.frag.glsl
uniform float u_point;      // edge of a point [texels of level 0]
#endif

layout(location = 0) out vec4 out_irradiance;  // a: direct light, the mean of RGB
layout(location = 1) out float out_variance;   // of the mean of RGB

#if FINER
// The point at a place of the atlas, counted in points; negative where there is none of the chart.
ivec2 point_at(vec2 place, uint chart) {
    ivec2 px = texel_px_at(place * u_point);
    return px.y >= 0 && texelFetch(t_origin_normal, px, 0).y == chart ? px : ivec2(-1);
}

// Whether a way leads from a point to the one beside it, along u (axis 0) or v.
bool open(ivec2 px, ivec2 next_px, int axis, float step) {
    return px.y >= 0 && next_px.y >= 0 && texelFetch(t_walls, step > 0.0 ? px : next_px, 0)[axis] < 0.5;
}

vec4 indirect_at(ivec2 px) {
    vec3 leaf = texelFetch(t_own_leaves, px / TILE, 0).xyz;
    vec2 place = (leaf.xy * float(TILE) + vec2(px % TILE) + 0.5) * leaf.z / u_point;
    vec2 own = floor(place) + 0.5, step = sign(place - own), share = abs(place - own);
    uint chart = texelFetch(t_own_normal, px, 0).y;
    ivec2 points[4];  // bit 0 of their number: a step along u; bit 1: along v
    for (int i = 0; i < 4; ++i) points[i] = point_at(own + step * vec2(i & 1, i >> 1), chart);
    bool reached[4] = bool[](points[0].y >= 0, open(points[0], points[1], 0, step.x), open(points[0], points[2], 1, step.y), false);
    reached[3] = reached[1] && open(points[1], points[3], 1, step.y) || reached[2] && open(points[2], points[3], 0, step.x);
    vec4 sum = vec4(0.0), all = vec4(0.0);
    float weights = 0.0, every = 0.0;
    for (int i = 0; i < 4; ++i) {
        if (points[i].y < 0) continue;
        vec2 weight = mix(1.0 - share, share, vec2(i & 1, i >> 1));
        vec4 light = texelFetch(t_indirect, points[i], 0);
        all += weight.x * weight.y * light;
        every += weight.x * weight.y;
        if (!reached[i]) continue;
        sum += weight.x * weight.y * light;
        weights += weight.x * weight.y;
    }
    return weights > 0.0 ? sum / weights : all / max(every, 1e-6);
}
#else
vec4 indirect_at(ivec2 px) { return texelFetch(t_indirect, px, 0); }
#endif

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    vec4 direct = texelFetch(t_direct, px, 0), indirect = indirect_at(px);
    out_irradiance = vec4(direct.rgb + indirect.rgb, dot(direct.rgb, vec3(1.0 / 3.0)));
    out_variance = direct.a + indirect.a;
}
