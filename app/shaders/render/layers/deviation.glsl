// Error that a solver expects of the irradiance H: standard deviation of its mean over RGB, over that mean.
uniform sampler2D t_light;    // irradiance H
uniform sampler2D t_offered;  // variance of the mean of RGB

vec3 layer_colour(ivec2 texel_px) {
    float mean = dot(texelFetch(t_light, texel_px, 0).rgb, vec3(1.0 / 3.0));
    return vec3(sqrt(max(texelFetch(t_offered, texel_px, 0).r, 0.0)) / max(mean, 1e-20));
}

vec3 unlit_colour(int material) { return vec3(0.0); }
