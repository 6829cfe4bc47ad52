// A number on every texel.
uniform sampler2D t_offered;

vec3 layer_colour(ivec2 texel_px) { return vec3(texelFetch(t_offered, texel_px, 0).r); }

vec3 unlit_colour(int material) { return vec3(0.0); }
