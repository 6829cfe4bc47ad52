// Another albedo or emission, B = E + ρH: what that changes is still to be shot, Δr = ΔE + Δρ·H, negative where light goes.
// Blended into r. [Chen90]
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "common/exitance.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_before;     // the table of materials until now
uniform sampler2D t_materials;  // and from now on
uniform sampler2D t_irradiance;
uniform float u_unit;  // W/m² per stored unit

layout(location = 0) out vec4 out_residual;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    Texel texel = load_texel(t_position_area, t_normal_ids, px);
    vec3 before = albedo_of(t_before, texel.material, px), after = albedo_of(t_materials, texel.material, px);
    vec3 emitted = exitance_of(t_materials, texel.material, px) - exitance_of(t_before, texel.material, px);
    vec3 change = emitted / u_unit + (after - before) * texelFetch(t_irradiance, px, 0).rgb;
    out_residual = vec4(texel.area > 0.0 ? change : vec3(0.0), 0.0);
}
