// Tiles are copied aside before others take their light over: H, what each texel has shot, and its area.
#include "common/atlas.glsl"
#include "lightmap/kept.glsl"

uniform sampler2D t_position_area;
uniform sampler2D t_irradiance;
uniform sampler2D t_residual;

flat in vec2 v_corner;
flat in vec2 v_from;

layout(location = 0) out vec4 out_irradiance;
layout(location = 1) out vec4 out_kept;
layout(location = 2) out float out_area;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy - v_corner + v_from);
    out_irradiance = texelFetch(t_irradiance, px, 0);
    out_kept = kept_from_residual(px, out_irradiance.rgb, texelFetch(t_residual, px, 0));
    out_area = texelFetch(t_position_area, px, 0).w;
}
