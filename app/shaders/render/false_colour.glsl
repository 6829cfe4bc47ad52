// A number per pixel as a colour: viridis (van der Walt and Smith, CC0), sixth-order fit by Matt Zucker (CC0). The
// radiance becomes luminous by 683 lm/W, see app/render/units.py.
uniform float u_per_radiance;  // what is measured per W/(sr m²)
uniform vec2 u_range;          // lowest and highest value; a linear scale begins at 0
uniform float u_logarithmic;   // 0 or 1

vec3 viridis(float x) {
    const vec3 c0 = vec3(0.2777273272234177, 0.005407344544966578, 0.3340998053353061);
    const vec3 c1 = vec3(0.1050930431085774, 1.404613529898575, 1.384590162594685);
    const vec3 c2 = vec3(-0.3308618287255563, 0.214847559468213, 0.09509516302823659);
    const vec3 c3 = vec3(-4.634230498983486, -5.799100973351585, -19.33244095627987);
    const vec3 c4 = vec3(6.228269936347081, 14.17993336680509, 56.69055260068105);
    const vec3 c5 = vec3(4.776384997670288, -13.74514537774601, -65.35303263337234);
    const vec3 c6 = vec3(-5.435455855934631, 4.645852612178535, 26.3124352495832);
    return c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * (c5 + x * c6)))));
}

vec3 develop(vec3 radiance) {
    float value = dot(radiance, LUMINANCE) * u_per_radiance;
    float linear = value / u_range.y;
    float decades = log2(max(value, 1e-20) / max(u_range.x, 1e-20)) / log2(u_range.y / max(u_range.x, 1e-20));
    return decode_srgb(clamp(viridis(clamp(mix(linear, decades, u_logarithmic), 0.0, 1.0)), 0.0, 1.0));
}
