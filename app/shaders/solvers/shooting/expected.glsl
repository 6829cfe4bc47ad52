// What is to be shot: the residual r, and the light that it will make come back, shot ahead [Feda92]: about the ambient irradiance,
// but no more than a texel has got until now.
uniform sampler2D t_ambient;  // irradiance, stored units: see ambient.frag.glsl

// H: of the texel
vec3 light_ahead(vec3 H, vec3 albedo) { return albedo * clamp(texelFetch(t_ambient, ivec2(0), 0).rgb, -abs(H), abs(H)); }
