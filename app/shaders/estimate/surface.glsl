// What a ray finds: B = E + ρ(H + a) of the texel that it hits. What emits is told by the material, not by the texel: coarse texels
// leave out what all but touches another surface, and a lamp that hangs there must not be missed here, too.
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "common/ambient.glsl"
#include "common/exitance.glsl"
#include "common/texel_at.glsl"
#include "visibility/rays.glsl"

uniform sampler2D t_faces;  // material, 1 where both sides shine, of each slot of the triangles
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_irradiance;
uniform float u_unit;  // W/m² per stored unit

struct Surface {
    vec3 exitance;  // E [W/m²]
    vec3 albedo;
    vec3 irradiance;  // H + a [W/m²]
    float strength;  // of the material's E, without a texture, the mean of its colours: what lamps are chosen by
};

Surface surface_of(Hit hit) {
    Surface seen = Surface(vec3(0.0), vec3(0.0), vec3(0.0), 0.0);
    vec2 face = texelFetch(t_faces, entry_px(hit.slot, 1), 0).xy;
    if (!hit.front && face.y == 0.0) return seen;
    uint material = uint(face.x);
    vec2 place = place_of(hit);
    ivec2 px = place.x < 0.0 ? ivec2(-1) : texel_px_at(place);
    seen.strength = dot(texelFetch(t_materials, ivec2(1, int(material)), 0).rgb, vec3(1.0 / 3.0));
    seen.exitance = exitance_of(t_materials, material, max(px, 0));
    if (px.y < 0 || facet_from_ids(texelFetch(t_normal_ids, px, 0).y) == 0u) return seen;  // no light is held there
    vec3 H = texelFetch(t_irradiance, px, 0).rgb;
    seen.albedo = albedo_of(t_materials, material, px);
    seen.irradiance = (H + ambient_at(px, H)) * u_unit;
    return seen;
}
