// Linear Rec.709: luminance [IEC 61966-2-1], the sRGB transfer function and back.
const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);

vec3 encode_srgb(vec3 linear) {
    vec3 curve = 1.055 * pow(max(linear, 0.0031308), vec3(1.0 / 2.4)) - 0.055;
    return mix(curve, 12.92 * linear, lessThanEqual(linear, vec3(0.0031308)));
}

vec3 decode_srgb(vec3 encoded) {
    vec3 curve = pow((max(encoded, 0.04045) + 0.055) / 1.055, vec3(2.4));
    return mix(curve, encoded / 12.92, lessThanEqual(encoded, vec3(0.04045)));
}
