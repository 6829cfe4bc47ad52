// A colour per level of a quadtree: green at the roots, then teal, blue, violet, magenta, red.
vec3 level_colour(float level) { return 0.5 + 0.45 * cos(6.2831853 * (0.72 - 0.12 * level + vec3(0.0, 0.33, 0.67))); }
