// What rays find: on every texel of level 0 of the atlas the light that is sent on, ρH, and E where no shadow ray is sent to it.
// The mean over its leaves where they are finer.
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "common/texel_at.glsl"
#define EMISSION_TEXTURE 0
#if EMISSION_TEXTURE
uniform sampler2D t_emission;
#endif

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_sources;  // exitance [stored units] of the materials whose light rays bring
uniform sampler2D t_solution;
uniform int u_depth;  // of the finest leaves

layout(location = 0) out vec4 out_outgoing;

vec4 outgoing(ivec2 px) {
    float A = texelFetch(t_position_area, px, 0).w;
    uint ids = texelFetch(t_normal_ids, px, 0).y;
    if (A <= 0.0) return vec4(0.0);
    uint material = material_from_ids(ids);
    vec3 E = texelFetch(t_sources, ivec2(0, int(material)), 0).rgb;
#if EMISSION_TEXTURE
    E *= texelFetch(t_emission, px, 0).rgb;
#endif
    return A * vec4(E + albedo_of(t_materials, material, px) * texelFetch(t_solution, px, 0).rgb, 1.0);
}

int even_bits(int z) {  // [Morton66]
    z &= 0x5555;
    z = (z | z >> 1) & 0x3333;
    z = (z | z >> 2) & 0x0F0F;
    return (z | z >> 4) & 0x00FF;
}

void main() {
    vec2 corner = floor(gl_FragCoord.xy);
    vec4 sum = vec4(0.0);
    float finest = exp2(-float(u_depth));
    int z = 0;  // the texels of the finest level in this one, along the Morton curve, where leaves of any level follow one another
    do {
        vec2 at = corner + vec2(even_bits(z), even_bits(z >> 1)) * finest;
        ivec2 slot = slot_at(at + 0.5 * finest);
        float size = slot.y < 0 ? finest : texelFetch(t_leaves, slot, 0).z;
        if (slot.y >= 0) sum += outgoing(texel_px_at(at + 0.5 * finest));
        int step = int(size / finest + 0.5);
        z += step * step;
    } while (z < 1 << 2 * u_depth);
    out_outgoing = vec4(sum.w > 0.0 ? sum.rgb / sum.w : vec3(0.0), 1.0);
}
