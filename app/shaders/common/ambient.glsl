// The ambient light that the rest of a solve will add to a texel: about the ambient irradiance of all light that is unshot
// [Cohen88, section 5]. It is clamped to the irradiance that the texel has received, so that unlit rooms are not lit by what
// other rooms have yet to shoot; when less is to come than has arrived, to a few times that share of it; and while light comes from
// outside, to as many times as it has shots to come. Where less light is to be there than was shot, residual and ambient are
// negative.
uniform sampler2D t_ambient;  // irradiance, stored units; a: how many times what it has received a texel may have of it at most

// H: irradiance of the texel
vec3 ambient_of(vec3 H) {
    vec4 ambient = texelFetch(t_ambient, ivec2(0), 0);
    vec3 most = ambient.a * abs(H);
    return clamp(ambient.rgb, -most, most);
}
