// What is to be shot: the residual r, and the light that it will make come back, shot ahead [Feda92]. The rest of the solve will add
// about the ambient irradiance [Cohen88] to every texel, but no more than it has got until now, or light that other rooms keep for
// themselves would be shot.
uniform sampler2D t_ambient;  // irradiance, stored units: see ambient.frag.glsl

// H: of the texel. Less light than was shot has a negative residual, and ambient.
vec3 light_ahead(vec3 H, vec3 albedo) { return albedo * clamp(texelFetch(t_ambient, ivec2(0), 0).rgb, -abs(H), abs(H)); }
