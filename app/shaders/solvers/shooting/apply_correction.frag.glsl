// The correction C takes the place of what a leaf inherited: H += C, r += ρ C. C is what the shots so far give to the leaf,
// summed anew, minus what it held of them. Blended.
#include "common/atlas.glsl"
#include "common/albedo.glsl"

uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_correction;

flat in vec2 v_corner;
flat in vec2 v_from;

layout(location = 0) out vec4 out_irradiance;
layout(location = 1) out vec4 out_residual;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy - v_corner + v_from);
    uint ids = texelFetch(t_normal_ids, px, 0).y;
    vec4 C = texelFetch(t_correction, px, 0);
    out_irradiance = C;
    out_residual = vec4(albedo_of(t_materials, material_from_ids(ids), px) * C.rgb, 0.0);
}
