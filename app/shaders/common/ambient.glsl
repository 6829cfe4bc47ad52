// What the rest of the solve will add to a texel: about the ambient irradiance of all light that is unshot [Cohen88, section 5], but
// no more than it has got until now, or light that other rooms keep for themselves would be there. Less light than was shot has
// a negative residual, and ambient.
uniform sampler2D t_ambient;  // irradiance, stored units: see ambient.frag.glsl

// H: irradiance of the texel
vec3 ambient_of(vec3 H) { return clamp(texelFetch(t_ambient, ivec2(0), 0).rgb, -abs(H), abs(H)); }
