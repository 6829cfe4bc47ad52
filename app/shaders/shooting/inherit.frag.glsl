// C = -H: what a leaf holds before the shots so far are summed anew.
uniform sampler2D t_irradiance;

flat in vec2 v_corner;
flat in vec2 v_from;

layout(location = 0) out vec4 out_correction;

void main() { out_correction = -texelFetch(t_irradiance, ivec2(gl_FragCoord.xy - v_corner + v_from), 0); }
