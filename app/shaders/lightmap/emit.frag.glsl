// r = E: before the first shot every texel holds its own exitance. [Coombe03, section 3]
#include "common/atlas.glsl"
#include "common/exitance.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform float u_unit;  // W/m² per stored unit

layout(location = 0) out vec4 out_residual;

void main() {
    ivec2 texel_px = ivec2(gl_FragCoord.xy);
    Texel texel = load_texel(t_position_area, t_normal_ids, texel_px);
    out_residual = vec4(0.0);
    if (texel.area > 0.0) out_residual.rgb = exitance_of(t_materials, texel.material, texel_px) / u_unit;
}
