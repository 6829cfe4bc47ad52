// What is to be shot: the residual r, and the light that it will make come back, shot ahead [Feda92].
#include "common/ambient.glsl"

// H: of the texel
vec3 light_ahead(vec3 H, vec3 albedo) { return albedo * ambient_of(H); }
