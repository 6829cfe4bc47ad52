// L / (1 + L) on luminance. [Reinhard02, equation 3]
vec3 develop(vec3 rgb) { return clamp(rgb / (1.0 + dot(rgb, LUMINANCE)), 0.0, 1.0); }
