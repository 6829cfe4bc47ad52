// What a visibility map shows: item, and depth along the sight. At FAR it loses against the open. Includes <fragment> before, and
// where surfaces are drawn that are not opaque, how a place as a shooter sees it is found in the solver space:
//
//     vec3 seen_from(int map)                  where the shooter of a map is
//     vec3 place_seen(int map, vec3 local)     solver space
#include "common/item.glsl"
#if OPACITY
#include "visibility/opacity.glsl"
uniform int u_sheer;  // rows of t_sheer
#endif

layout(location = 0) out float out_item;

void main() {
    vec2 seen = item_and_depth();
#if OPACITY
    int map = int(gl_FragCoord.y / MAP_PX.y), row = gl_PrimitiveID % u_sheer;
    vec2 px = gl_FragCoord.xy - vec2(0.0, float(map) * MAP_PX.y);
    int view = view_from_px(px);
    vec3 local = local_from_view(view, sight_from_px(view, px)) * seen.y;
    if (chance_in_map(seen_from(map), ivec2(px), row) >= opacity_at(row, place_seen(map, local))) discard;
#endif
    out_item = seen.x;
    gl_FragDepth = depth_in_map(seen);
}
