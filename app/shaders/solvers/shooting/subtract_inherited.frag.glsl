// C = -H: the correction of a leaf begins with minus what it inherited of the shots that are summed anew; or C = S - H, where S
// holds those that are not.
uniform sampler2D t_light;
uniform sampler2D t_other;
uniform float u_other;  // whether it counts

flat in vec2 v_corner;
flat in vec2 v_from;

layout(location = 0) out vec4 out_correction;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy - v_corner + v_from);
    out_correction = u_other * texelFetch(t_other, px, 0) - texelFetch(t_light, px, 0);
}
