// Border texels that edges.frag.glsl made, at their places: one rectangle for half an edge of a leaf, or for a corner.
uniform sampler2D t_made;
uniform sampler2D t_edges;  // as in edges.frag.glsl
uniform int u_border;
uniform int u_along;  // texels in a row of them

flat in vec2 v_corner;
flat in vec2 v_from;

layout(location = 0) out vec4 out_colour;

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy - v_corner), from = ivec2(v_from);
    bool upright = texelFetch(t_edges, ivec2(from.x / (u_along * u_border), from.y), 0).w == 0.0;
    if (upright) place = place.yx;
    out_colour = texelFetch(t_made, from + ivec2(place.x + place.y * u_along, 0), 0);
}
