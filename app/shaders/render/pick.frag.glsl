// One pixel: which triangle, which side, where. See app/render/pick.py.
in vec3 v_position;
in vec4 v_uv;
#define OPACITY 0
#if OPACITY
#include "visibility/opacity.glsl"
flat in uint v_row;
#endif

layout(location = 0) out uvec2 out_ids;      // triangle, from 1, as they are drawn; 1 = back side, 2 = one of those that are not opaque
layout(location = 1) out vec4 out_atlas;     // atlas texels u, v
layout(location = 2) out vec4 out_position;  // solver space

void main() {
    out_ids = uvec2(uint(gl_PrimitiveID) + 1u, gl_FrontFacing ? 0u : 1u);
#if OPACITY
    if (opacity_at(int(v_row), v_position) <= 0.0) discard;
    out_ids = uvec2(v_row + 1u, out_ids.y + 2u);
#endif
    out_atlas = vec4(gl_FrontFacing ? v_uv.xy : v_uv.zw, 0.0, 0.0);
    out_position = vec4(v_position, 1.0);
}
