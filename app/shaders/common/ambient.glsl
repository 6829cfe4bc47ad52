// The ambient light that the rest of a solve will add to a texel: about the ambient irradiance of all light that is unshot
// [Cohen88, section 5]. It is clamped to the irradiance that the texel has received, so that unlit rooms are not lit by what
// other rooms have yet to shoot; and when less is to come than has arrived, to a few times that share of it. Where less light is
// to be there than was shot, residual and ambient are negative.
uniform sampler2D t_ambient;  // irradiance, stored units, and that over what has arrived on average: see ambient.frag.glsl

const float SHARES = 4.0;  // fewer leave rooms without lamps dark that get all of their light late, more light dark corners

// H: irradiance of the texel
vec3 ambient_of(vec3 H) {
    vec4 ambient = texelFetch(t_ambient, ivec2(0), 0);
    vec3 most = min(1.0, SHARES * ambient.a) * abs(H);
    return clamp(ambient.rgb, -most, most);
}
