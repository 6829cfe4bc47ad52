// Albedo ρ of a texel: the material's factor, times the texel's texture where the scene has one.
#define ALBEDO_TEXTURE 0

#if ALBEDO_TEXTURE
uniform sampler2D t_albedo;
#endif

vec3 albedo_texture(ivec2 texel_px) {
#if ALBEDO_TEXTURE
    return texelFetch(t_albedo, texel_px, 0).rgb;
#else
    return vec3(1.0);
#endif
}

vec3 albedo_of(sampler2D materials, uint material, ivec2 texel_px) {
    return texelFetch(materials, ivec2(0, int(material)), 0).rgb * albedo_texture(texel_px);
}
