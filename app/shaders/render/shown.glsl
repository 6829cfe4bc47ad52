// How display texels hold light: developed for the screen, or as it is, where pixels develop it. Needs develop(rgb).
#define LINEAR 0

vec3 shown(vec3 light) {
#if LINEAR
    return light;
#else
    return encode_srgb(develop(light));
#endif
}
