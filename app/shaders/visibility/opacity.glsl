// What of a surface that is not opaque is there. See app/visibility/opacity.py for the textures.
#include "common/sequence.glsl"

uniform sampler2D t_sheer;  // four texels a row, a row for each such triangle
uniform sampler2D t_alpha;

const int SHEER_A_ROW = 1024;  // rows in a row of the texture

vec4 sheer_texel(int row, int texel) { return texelFetch(t_sheer, ivec2(row % SHEER_A_ROW * 4 + texel, row / SHEER_A_ROW), 0); }

// i in [0, size): repeated, clamped or mirrored
int wrapped(int i, int size, int how) {
    int twice = i % (2 * size);
    if (twice < 0) twice += 2 * size;
    return how == 1 ? clamp(i, 0, size - 1) : how == 2 ? min(twice, 2 * size - 1 - twice) : twice % size;
}

float alpha_at(ivec2 px, vec4 rect, int wrap) {
    ivec2 size = ivec2(rect.zw);
    return texelFetch(t_alpha, ivec2(rect.xy) + ivec2(wrapped(px.x, size.x, wrap % 3), wrapped(px.y, size.y, wrap / 3)), 0).r;
}

// Of a row's triangle at a place on it, solver space; 0 or 1 where it has a cutoff.
float opacity_at(int row, vec3 position) {
    vec4 rect = sheer_texel(row, 2), values = sheer_texel(row, 3);
    float opacity = values.x;
    if (rect.z > 0.0) {
        vec4 u = sheer_texel(row, 0), v = sheer_texel(row, 1);
        vec2 at = vec2(dot(u.xyz, position) + u.w, dot(v.xyz, position) + v.w);
        int wrap = int(values.z);
        if (values.w > 0.0) {
            vec2 low = floor(at - 0.5), share = at - 0.5 - low;
            ivec2 px = ivec2(low);
            vec2 upper = vec2(alpha_at(px, rect, wrap), alpha_at(px + ivec2(1, 0), rect, wrap));
            vec2 lower = vec2(alpha_at(px + ivec2(0, 1), rect, wrap), alpha_at(px + 1, rect, wrap));
            vec2 columns = mix(upper, lower, share.y);
            opacity *= mix(columns.x, columns.y, share.x);
        } else {
            opacity *= alpha_at(ivec2(floor(at)), rect, wrap);
        }
    }
    return values.y < 0.0 ? opacity : float(opacity >= values.y);
}

// A number in [0, 1) below which a ray's opacity stops it, the same whenever the same ray meets the same triangle.
float chance(vec3 origin, vec3 direction, int row) {
    uvec3 bits = hash(floatBitsToUint(origin)) ^ floatBitsToUint(direction);
    return float(hash(bits + uvec3(uint(row))).x >> 8) * (1.0 / 16777216.0);
}

// The same for a sample of a map: gradient · px, a lattice, with steps along rows and columns such that neighbours have numbers
// that are spread evenly, as those of interleaved gradient noise [Jimenez14]. Shifted on each triangle, seen from each origin. One
// map is all that a directional light has: behind two panes of one gradient it would show how much their shifts are alike, and not
// the product of what both let pass. So every two triangles, as a pane has them, have a gradient of their own, by a hash of their
// number: turned, mirrored, and anywhere between these steps. Of 256² samples two or three panes pass what they should within 0.1
// to 0.2 % on average, 6 % at worst; 0.4 and 2 % by chance alone.
const vec2 LEAST_STEPS = vec2(0.15, 0.43), MOST_STEPS = vec2(0.40, 0.49);

float chance_in_map(vec3 origin, ivec2 px, int row) {
    uint shift = hash(hash(floatBitsToUint(origin)) + uvec3(uint(row))).x >> 8;
    uvec3 pane = hash(uvec3(uint(row >> 1), 0u, 1u));
    vec2 gradient = mix(LEAST_STEPS, MOST_STEPS, vec2(pane.xy >> 8) * (1.0 / 16777216.0));
    if ((pane.z & 0x10000u) != 0u) gradient = gradient.yx;
    if ((pane.z & 0x20000u) != 0u) gradient.x = -gradient.x;
    return fract(dot(vec2(px), gradient) + float(shift) * (1.0 / 16777216.0));
}
