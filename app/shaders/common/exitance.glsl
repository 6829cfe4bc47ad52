// Exitance E = πL of a texel [W/m²]: the material's factor, times the texel's texture where the scene has one.
#define EMISSION_TEXTURE 0

#if EMISSION_TEXTURE
uniform sampler2D t_emission;
#endif

vec3 exitance_of(sampler2D materials, uint material, ivec2 texel_px) {
    vec3 E = texelFetch(materials, ivec2(1, int(material)), 0).rgb;
#if EMISSION_TEXTURE
    E *= texelFetch(t_emission, texel_px, 0).rgb;
#endif
    return E;
}
