// How light is held: developed for the screen, or as it is. Needs develop(rgb).
#define LINEAR 0

vec3 shown(vec3 light) {
#if LINEAR
    return light;
#else
    return encode_srgb(develop(light));
#endif
}
