// What rays find on every point: the light that it sends on, ρH, and its E where no shadow ray is sent to it.
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#define EMISSION_TEXTURE 0
#if EMISSION_TEXTURE
uniform sampler2D t_emission;
#endif

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_sources;  // exitance [stored units] of the materials whose light rays bring
uniform sampler2D t_solution;

layout(location = 0) out vec4 out_outgoing;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    out_outgoing = vec4(0.0);
    if (texelFetch(t_position_area, px, 0).w <= 0.0) return;
    uint material = material_from_ids(texelFetch(t_normal_ids, px, 0).y);
    vec3 E = texelFetch(t_sources, ivec2(0, int(material)), 0).rgb;
#if EMISSION_TEXTURE
    E *= texelFetch(t_emission, px, 0).rgb;
#endif
    out_outgoing.rgb = E + albedo_of(t_materials, material, px) * texelFetch(t_solution, px, 0).rgb;
}
