// No curve: what is brighter than the screen is cut off.
vec3 develop(vec3 rgb) { return clamp(rgb, 0.0, 1.0); }
