// Directions in proportion to the light of the sky, and how densely they lie: see app/direct_light/sky_map.py.
#include "common/sky.glsl"
uniform sampler2D t_sky_rows;     // chances of the rows of its map, summed up
uniform sampler2D t_sky_columns;  // r: in each row those of its pixels, summed up; g: density over the map's unit square

// The first of ``count`` entries along ``step`` from ``first`` on whose sum is beyond a number; where in its share that lies.
int sky_entry(sampler2D table, ivec2 first, ivec2 step, int count, float number, out float rest) {
    int low = 0, high = count - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (number < texelFetch(table, first + middle * step, 0).r) high = middle; else low = middle + 1;
    }
    float before = low == 0 ? 0.0 : texelFetch(table, first + (low - 1) * step, 0).r;
    float share = texelFetch(table, first + low * step, 0).r - before;
    rest = clamp((number - before) / max(share, 1e-30), 0.0, 1.0);
    return low;
}

vec3 sky_direction(vec2 share) {
    ivec2 size = textureSize(t_sky_columns, 0);
    vec2 within;
    int row = sky_entry(t_sky_rows, ivec2(0), ivec2(1, 0), size.y, share.y, within.y);
    int column = sky_entry(t_sky_columns, ivec2(0, row), ivec2(1, 0), size.x, share.x, within.x);
    vec2 uv = (vec2(column, row) + within) / vec2(size);
    float azimuth = TURN * uv.x, down = 0.5 * TURN * uv.y;
    return vec3(sin(down) * sin(azimuth), cos(down), -sin(down) * cos(azimuth));
}

// Of ``sky_direction``, per solid angle [1/sr], at a direction and its place in the map.
float sky_density(vec3 direction, vec2 uv) {
    ivec2 size = textureSize(t_sky_columns, 0), px = min(ivec2(uv * vec2(size)), size - 1);
    float sine = sqrt(max(1.0 - direction.y * direction.y, 1e-12));
    return texelFetch(t_sky_columns, px, 0).g / (0.5 * TURN * TURN * sine);
}
