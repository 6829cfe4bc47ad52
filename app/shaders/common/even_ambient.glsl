// An ambient term of which no more is known than what all texels receive alike, and where light came from until now. Three pixels:
//
//   0  what all receive
//   1  what lamps and sources outside have yet to give, over what a texel has received
//   2  the most of that
vec3 from_sources(sampler2D even, vec3 H) {
    vec3 most = texelFetch(even, ivec2(2, 0), 0).rgb;
    return clamp(texelFetch(even, ivec2(1, 0), 0).rgb * H, -most, most);
}

// H: irradiance of the texel now
vec3 even_ambient(sampler2D even, vec3 H) {
    return max(texelFetch(even, ivec2(0), 0).rgb + from_sources(even, H), -abs(H));
}
