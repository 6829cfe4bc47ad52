// Rays as lines of a width in pixels, one instance each; what lies behind the eye is cut off.
uniform mat4 u_clip_from_local;
uniform vec2 u_size_px;
uniform float u_width_px;
uniform float u_seam_px;  // on both sides

in vec3 in_start;  // solver space
in vec3 in_end;
in vec3 in_light;

flat out vec3 v_light;
out float v_side_px;

const float NEAREST = 1e-4;  // before the eye, solver space

void main() {
    vec4 ends[2] = vec4[](u_clip_from_local * vec4(in_start, 1.0), u_clip_from_local * vec4(in_end, 1.0));
    for (int i = 0; i < 2; ++i) {
        float here = ends[i].w, there = ends[1 - i].w;
        if (here < NEAREST && there > NEAREST) ends[i] = mix(ends[i], ends[1 - i], (NEAREST - here) / (there - here));
    }
    vec2 way = (ends[1].xy / ends[1].w - ends[0].xy / ends[0].w) * u_size_px;
    vec2 across = vec2(-way.y, way.x) / max(length(way), 1e-6);
    float side = float(gl_VertexID & 1) * 2.0 - 1.0;
    v_side_px = side * (0.5 * u_width_px + u_seam_px + 0.5);
    v_light = in_light;
    gl_Position = ends[gl_VertexID >> 1];
    gl_Position.xy += across * v_side_px * 2.0 / u_size_px * gl_Position.w;
    if (min(ends[0].w, ends[1].w) < 0.5 * NEAREST) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}
