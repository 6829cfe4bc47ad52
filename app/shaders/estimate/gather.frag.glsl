// What a sample of the map adds to the irradiance: B = E + ρ(H + a) of the texel that it sees, times its delta form factor. [Cohen85]
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "common/ambient.glsl"
#include "common/exitance.glsl"
#include "common/item.glsl"
#include "common/texel_at.glsl"
#include "visibility/projections/hemicube.glsl"

uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_irradiance;
uniform float u_unit;  // W/m² per stored unit

in vec4 v_uv;
flat in ivec2 v_view;

layout(location = 0) out vec4 out_irradiance;  // [W/m²]

vec3 radiosity_at(vec2 uv) {
    ivec2 px = texel_px_at(uv);
    if (px.y < 0) return vec3(0.0);
    uint ids = texelFetch(t_normal_ids, px, 0).y;
    if (facet_from_ids(ids) == 0u) return vec3(0.0);
    uint material = material_from_ids(ids);
    vec3 H = texelFetch(t_irradiance, px, 0).rgb;
    return exitance_of(t_materials, material, px) + albedo_of(t_materials, material, px) * (H + ambient_of(H)) * u_unit;
}

void main() {
    vec2 uv = gl_FrontFacing ? v_uv.xy : v_uv.zw;  // negative where a side has no texels: it is black, or nothing lies before it
    float share = delta_form_factor(v_view.x, gl_FragCoord.xy - vec2(0.0, float(v_view.y) * MAP_PX.y));
    out_irradiance = vec4(uv.x < 0.0 ? vec3(0.0) : radiosity_at(uv) * share, 0.0);
    gl_FragDepth = 1.0 / (gl_FragCoord.w * FAR);  // linear, as in the maps of shooters
}
