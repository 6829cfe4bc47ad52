// Overshoot: a patch shoots its residual r, and with it the light that this will make come back [Feda92]: about the ambient
// irradiance, but no more than a texel has received until now.
uniform sampler2D t_ambient;  // irradiance, stored units: see even_ambient.frag.glsl

// H: of the texel
vec3 overshoot(vec3 H, vec3 albedo) { return albedo * clamp(texelFetch(t_ambient, ivec2(0), 0).rgb, -abs(H), abs(H)); }
