// The ambient light of a texel: about the irradiance that it will still receive, see app/solvers/shooting/ambient.py. Where less
// light is to be there than was shot, residual and ambient are negative.
uniform sampler2D t_ambient;  // irradiance, stored units; of one texel, where all have the same

vec3 ambient_at(ivec2 texel_px) { return texelFetch(t_ambient, min(texel_px, textureSize(t_ambient, 0) - 1), 0).rgb; }
