// What every texel has yet to pass on: its residual r, and what it will reflect of its ambient light a.
//
//   r + ρ a
//
// What lamps have yet to shoot is left out: few rays would find them. See to_come.frag.glsl.
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "common/ambient.glsl"

uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_irradiance;
uniform sampler2D t_residual;

layout(location = 0) out vec4 out_to_pass_on;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    uint material = material_from_ids(texelFetch(t_normal_ids, px, 0).y);
    vec3 E = texelFetch(t_materials, ivec2(1, int(material)), 0).rgb;
    vec3 r = texelFetch(t_residual, px, 0).rgb, a = ambient_at(px, texelFetch(t_irradiance, px, 0).rgb);
    out_to_pass_on = vec4((E == vec3(0.0) ? r : vec3(0.0)) + albedo_of(t_materials, material, px) * a, 0.0);
}
