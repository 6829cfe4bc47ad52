// Texel checker, texel and tile lines, and the patch that shot: all as wide as pixels, faded before they would alias. Tiles of a
// quadtree have the colour of their level, and shine when they are new.
#include "render/shine.glsl"
uniform float u_checker;  // 0 to 1
uniform float u_grid;     // 0 to 1
uniform float u_leaves;   // 1 for a quadtree
uniform float u_tile;     // texels along the edge of a leaf
uniform vec4 u_shooter;   // atlas texels: lower corner, upper corner

float line_at_integers(vec2 uv, vec2 per_px, float width_px) {
    vec2 distance_px = abs(fract(uv - 0.5) - 0.5) / per_px;
    return clamp(0.5 * width_px + 0.5 - min(distance_px.x, distance_px.y), 0.0, 1.0);
}

// uv: texels of level 0; finer: texels of the leaf for each of these; born: when the leaf was split off [s]
vec3 overlaid(vec3 colour, vec2 root_uv, vec2 root_per_px, float finer, float born) {
    vec2 uv = root_uv * finer, texels_per_px = root_per_px * finer;
    float texel_px = 1.0 / max(texels_per_px.x, texels_per_px.y);

    vec2 square = floor(uv);
    float dark = mix(0.5, fract((square.x + square.y) * 0.5) * 2.0, smoothstep(1.5, 3.0, texel_px));
    colour *= 1.0 - u_checker * dark;

    float texels = line_at_integers(uv, texels_per_px, 1.0) * smoothstep(3.0, 8.0, texel_px);
    float tiles = line_at_integers(uv / u_tile, texels_per_px / u_tile, 1.6) * smoothstep(0.2, 0.5, texel_px);
    vec3 contrast = vec3(max(colour.r, max(colour.g, colour.b)) > 0.72 ? 0.0 : 0.95);
    colour = mix(colour, contrast, u_grid * max(0.15 * texels, 0.35 * tiles * (1.0 - u_leaves)));
    float level = log2(max(finer, 1.0));
    colour = mix(colour, shining(colour, level, born), u_grid * u_leaves);
    colour = mix(colour, level_colour(level), u_grid * u_leaves * 0.8 * tiles);

    vec2 outside = max(u_shooter.xy - root_uv, root_uv - u_shooter.zw) / root_per_px;
    float distance_px = max(outside.x, outside.y);
    float shooter = max(clamp(2.0 - abs(distance_px), 0.0, 1.0), distance_px < 0.0 ? 0.3 : 0.0);
    return mix(colour, vec3(1.0, 0.68, 0.15), shooter);
}
