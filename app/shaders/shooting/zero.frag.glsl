// r_i = 0: what is about to be shot is no longer unshot. Before the batch shoots, or what one of its shooters gives to
// another would be erased.
#include "common/atlas.glsl"
#include "shooting/shooter.glsl"
#include "shooting/belongs.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_shooters;

flat in int v_shot;

layout(location = 0) out vec4 out_residual;

void main() {
    Shooter s = load_shooter(t_shooters, v_shot);
    Texel texel = load_texel(t_position_area, t_normal_ids, ivec2(gl_FragCoord.xy));
    if (!belongs(texel, s.normal, s.chart)) discard;
    out_residual = vec4(0.0);
}
