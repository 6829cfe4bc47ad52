// Bicubic reconstruction of radiosity textures [Bastos97] with the uniform cubic B-spline, in four bilinear look-ups [Sigg05].
//
// The B-spline and not Catmull-Rom: its weights are never negative, so that shadow edges get no halo and nothing leaves the range
// of the 8 bits that it reads; and its second derivative is continuous, so that no Mach band is left where texels meet, which is
// what bilinear texels are blamed for [Coombe03, 4.4]. Ramps stay ramps. The price: it passes near its texels, not through them,
// and softens detail of one texel.
//
// Along each axis the weights of the four texels around t in [0, 1) are
//     w0 = (1 - t)^3 / 6,  w1 = (3t^3 - 6t^2 + 4) / 6,  w3 = t^3 / 6,  w2 = 1 - w0 - w1 - w3,
// and one look-up between two of them gives both at once, in the share in which it lies between them.

// texel: where, in texels; size: of a texel, as the sampler counts
vec3 bicubic(sampler2D image, vec2 texel, vec2 size) {
    vec2 base = floor(texel - 0.5), t = texel - 0.5 - base, s = 1.0 - t;
    vec2 w0 = s * s * s / 6.0, w3 = t * t * t / 6.0;
    vec2 w1 = (3.0 * t - 6.0) * t * t / 6.0 + 2.0 / 3.0;
    vec2 lower = w0 + w1, upper = 1.0 - lower;
    vec2 a = (base - 0.5 + w1 / lower) * size, b = (base + 1.5 + w3 / upper) * size;
    vec3 below = lower.x * textureLod(image, a, 0.0).rgb + upper.x * textureLod(image, vec2(b.x, a.y), 0.0).rgb;
    vec3 above = lower.x * textureLod(image, vec2(a.x, b.y), 0.0).rgb + upper.x * textureLod(image, b, 0.0).rgb;
    return lower.y * below + upper.y * above;
}
