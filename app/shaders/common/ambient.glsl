// What the rest of the solve will add to a texel: about the ambient irradiance of all light that is unshot [Cohen88, section 5], but
// no more than it has got until now, or light that other rooms keep for themselves would be there; and when less is to come than
// has arrived, no more than a few times its share of that. Less light than was shot has a negative residual, and ambient.
uniform sampler2D t_ambient;  // irradiance, stored units, and that over what has arrived on average: see ambient.frag.glsl

const float SHARES = 4.0;  // fewer leave rooms without lamps dark that get all of their light late, more light dark corners

// H: irradiance of the texel
vec3 ambient_of(vec3 H) {
    vec4 ambient = texelFetch(t_ambient, ivec2(0), 0);
    vec3 most = min(1.0, SHARES * ambient.a) * abs(H);
    return clamp(ambient.rgb, -most, most);
}
