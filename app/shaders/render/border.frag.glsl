// Border texels that edges.frag.glsl made, at their places.
uniform sampler2D t_made;
uniform int u_along;  // texels in a row of them

flat in vec2 v_corner;
flat in vec3 v_from;

layout(location = 0) out vec4 out_colour;

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy - v_corner);
    if (v_from.z > 0.0) place = place.yx;
    out_colour = texelFetch(t_made, ivec2(v_from.xy) + ivec2(place.x + place.y * u_along, 0), 0);
}
