// Draws the hemisphere exactly, fragment side: the sight against the true triangle. [Gascuel08]
#include "common/item.glsl"
#include "visibility/projections/hemisphere.glsl"

flat in vec3 v_edge_a;
flat in vec3 v_edge_b;
flat in vec3 v_edge_c;
flat in vec4 v_plane;
flat in float v_item;

vec2 item_and_depth() {
    vec2 p = mod(gl_FragCoord.xy, MAP_PX) / R - 1.0;
    float r2 = dot(p, p);
    vec3 sight = vec3(2.0 * p, 1.0 - r2);  // times 1 + r2
    float inside = min(dot(sight, v_edge_a), min(dot(sight, v_edge_b), dot(sight, v_edge_c)));
    // rounding: two triangles share their edge
    if (inside < -COPLANAR) discard;
    return vec2(v_item, v_plane.w * (1.0 + r2) / dot(v_plane.xyz, sight));
}
