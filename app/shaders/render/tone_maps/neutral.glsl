// Khronos PBR Neutral (github.com/KhronosGroup/ToneMapping): true colours below 0.8, highlights compressed to white.
vec3 develop(vec3 rgb) {
    const float start = 0.8 - 0.04;  // 0.04: reflectance of a dielectric at normal incidence
    const float desaturation = 0.15;
    float low = min(rgb.r, min(rgb.g, rgb.b));
    rgb -= low < 0.08 ? low - 6.25 * low * low : 0.04;
    float peak = max(rgb.r, max(rgb.g, rgb.b));
    const float room = 1.0 - start;
    float new_peak = 1.0 - room * room / (max(peak, start) + room - start);
    float whitened = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0);
    vec3 compressed = mix(rgb * (new_peak / max(peak, start)), vec3(new_peak), whitened);
    return clamp(peak < start ? rgb : compressed, 0.0, 1.0);
}
