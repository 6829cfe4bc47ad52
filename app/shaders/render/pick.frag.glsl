// One pixel: which triangle, which side, where. See app/render/pick.py.
in vec3 v_position;
in vec4 v_uv;
flat in uvec4 v_ids;

layout(location = 0) out uvec4 out_ids;    // triangle + 1, 1 = back side, facet from 1, material
layout(location = 1) out vec4 out_atlas;   // atlas texels u, v
layout(location = 2) out vec4 out_position;  // solver frame

void main() {
    out_ids = uvec4(v_ids.w + 1u, gl_FrontFacing ? 0u : 1u, gl_FrontFacing ? v_ids.x : v_ids.y, v_ids.z);
    out_atlas = vec4(gl_FrontFacing ? v_uv.xy : v_uv.zw, 0.0, 0.0);
    out_position = vec4(v_position, 1.0);
}
