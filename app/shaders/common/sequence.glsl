// The k-th numbers of a texel: the Kronecker sequence of the root of x⁵ = x + 1 [Roberts18, R4], well spread in four dimensions,
// shifted for each texel by a hash of its place [Cranley76; Jarzynski20].
const uvec4 STEPS = uvec4(3679390609u, 3152041523u, 2700274806u, 2313257605u);  // 2^32 / x, / x², / x³, / x⁴

uvec3 hash(uvec3 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
    v ^= v >> 16u;
    v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
    return v;
}

// place: of the texel, a number for each texel of the atlas; stream: another sequence of the same texel. In [0, 1).
vec4 numbers(ivec3 place, uint stream, int k) {
    uvec3 a = hash(uvec3(place) + uvec3(0u, 0u, stream << 8));
    uvec4 bits = uvec4(a, hash(a).x) + uint(k) * STEPS;
    return vec4(bits >> 8) * (1.0 / 16777216.0);
}
