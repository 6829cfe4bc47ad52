// Reading the lightmap: texels, tiles, tables. See app/lightmap/textures.py for what the textures hold.
#define MATERIAL_BITS 1

const float PI = 3.14159265358979323846;

struct Texel {
    vec3 position;   // centroid of the covered surface, solver space
    float area;      // solver space; 0 = nothing here
    vec3 normal;
    uint facet;      // from 1; 0 = nothing here
    uint material;
};

// [Cigolle14] octahedral unit vector from two snorm16 (unpackSnorm2x16 is GLSL 4.2)
vec3 normal_from_octahedral(uint packed_normal) {
    vec2 e = vec2(int(packed_normal << 16) >> 16, int(packed_normal) >> 16) / 32767.0;
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    return normalize(n);
}

uint facet_from_ids(uint ids) { return ids >> MATERIAL_BITS; }
uint material_from_ids(uint ids) { return ids & ((1u << MATERIAL_BITS) - 1u); }

Texel load_texel(sampler2D position_area, usampler2D normal_ids, ivec2 texel_px) {
    vec4 pa = texelFetch(position_area, texel_px, 0);
    uvec2 ni = texelFetch(normal_ids, texel_px, 0).xy;
    return Texel(pa.xyz, pa.w, normal_from_octahedral(ni.x), facet_from_ids(ni.y), material_from_ids(ni.y));
}
