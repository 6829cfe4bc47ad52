// What is about to be shot is no longer unshot: before the batch shoots, or what one of its shooters gives to another would be
// erased. Blended: r_i = r_i a + rgb.
//
// A patch shoots its mean. Where its texels are alike but for their light, they keep what they have above or below the mean,
// which finer patches shoot later; else nothing is left of r_i. What was overshot leaves a negative residual.
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "solvers/shooting/shooter.glsl"
#include "solvers/shooting/belongs.glsl"
#include "solvers/shooting/overshoot.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_irradiance;
uniform sampler2D t_shooters;

flat in int v_shot;

layout(location = 0) out vec4 out_residual;

#define KEEPS 1  // whether the residual can be negative

void main() {
    Shooter s = load_shooter(t_shooters, v_shot);
    ivec2 px = ivec2(gl_FragCoord.xy);
    Texel texel = load_texel(t_position_area, t_normal_ids, px);
    if (!belongs(texel, s.normal, s.chart)) discard;
    vec3 over = overshoot(texelFetch(t_irradiance, px, 0).rgb, albedo_of(t_materials, texel.material, px));
    out_residual = KEEPS == 1 && is_even(s) ? vec4(-s.exitance, 1.0) : vec4(-over, 0.0);
}
