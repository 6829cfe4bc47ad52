// Draws the hemisphere by its vertices, fragment side: depth is where the sight meets the triangle's plane.
#include "common/item.glsl"
#include "visibility/projections/hemisphere.glsl"

flat in vec2 v_sides;
flat in vec4 v_plane;
flat in float v_own;

vec2 item_and_depth() {
    float slope = dot(v_plane.xyz, sight_from_px(0, mod(gl_FragCoord.xy, MAP_PX)));
    float depth = v_plane.w / slope;
    bool own = v_sides.r == v_own || v_sides.g == v_own;
    // on straight edges a sight may miss the plane
    return vec2(v_plane.w < 0.0 ? v_sides.r : v_sides.g, own || !(depth > 0.0) ? FAR : depth);
}
