// What a shot owns and could not give away, although it was scaled, stays where it is: its own patch receives it. Blended into H
// and r.
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "solvers/shooting/shooter.glsl"
#include "solvers/shooting/belongs.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_shooters;

flat in int v_shot;

layout(location = 0) out vec4 out_irradiance;
layout(location = 1) out vec4 out_residual;

void main() {
    Shooter s = load_shooter(t_shooters, v_shot);
    ivec2 px = ivec2(gl_FragCoord.xy);
    Texel texel = load_texel(t_position_area, t_normal_ids, px);
    float kept = 1.0 - s.open - s.black - s.gain * s.received;
    if (s.gain <= 1.0 || kept <= 0.0 || !belongs(texel, s.normal, s.chart)) discard;
    vec3 light = kept * s.exitance;
    out_irradiance = vec4(light, 0.0);
    out_residual = vec4(albedo_of(t_materials, texel.material, px) * light, 0.0);
}
