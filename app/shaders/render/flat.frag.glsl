// Shaded by the angle at which it is seen, as by a lamp at the eye: flat, the normal is that of the triangle.
#include "common/colour.glsl"
uniform vec3 u_eye;  // solver space

in vec3 v_position;
in vec3 v_colour;

layout(location = 0) out vec4 out_colour;

const float AMBIENT = 0.25;  // what is seen edge-on is not black

void main() {
    vec3 across = cross(dFdx(v_position), dFdy(v_position));
    vec3 away = u_eye - v_position;
    float cosine = abs(dot(across, away)) / max(length(across) * length(away), 1e-30);
    out_colour = vec4(encode_srgb(v_colour * mix(cosine, 1.0, AMBIENT)), 1.0);
}
