// How much of the shooter's sight a receiver point gets: the four map samples around it, weighted bilinearly.
// A map sample is (item, depth along its sight); the open background is item 0 at depth FAR.
//
//   VISIBILITY 0, item id   a sample sees the receiver if it shows the receiver's facet [Coombe03, 3.2]
//   VISIBILITY 1, depth     or if what it shows is no nearer than the receiver's own plane along that sample's sight
//   VISIBILITY 2, combined  either: ids save receivers from depth error, depth saves small triangles from id error
#define VISIBILITY 2

// Depth is single precision, interpolated across triangles that may be as long as the scene: 2^-14 of it covers the rounding
// (2^-23 a step) and is far below a texel.
const float DEPTH_SLACK = 1.0 / 16384.0;

float visible(float facet, vec3 local, vec3 normal_local, sampler2D map) {
    int view = view_from_direction(local);
    vec3 point = view_from_local(view, local), normal = view_from_local(view, normal_local);
    vec4 bounds = view_bounds_px(view);
    vec2 at = clamp(px_from_view(view, point), bounds.xy + 0.5, bounds.zw - 0.5) - 0.5;
    vec2 base = min(floor(at), bounds.zw - 2.0);
    vec2 f = at - base;
    float plane = dot(normal, point);
    float sum = 0.0;
    for (int k = 0; k < 4; ++k) {
        vec2 corner = vec2(k & 1, k >> 1);
        vec2 px = base + corner;
        vec2 shown = texelFetch(map, ivec2(px), 0).rg;
        bool seen = false;
#if VISIBILITY != 1
        seen = shown.r == facet;
#endif
#if VISIBILITY != 0
        // where this sample's sight meets the receiver's plane; past its horizon, the receiver's own depth
        float slope = dot(normal, sight_from_px(view, px + 0.5));
        float depth = slope * plane > 0.0 ? plane / slope : depth_from_view(point);
        seen = seen || shown.g >= depth * (1.0 - DEPTH_SLACK);
#endif
        vec2 weight = mix(1.0 - f, f, corner);
        sum += seen ? weight.x * weight.y : 0.0;
    }
    // the other side of what is seen: a shell without thickness has texels on both, in the same place
    return plane < 0.0 ? sum : 0.0;
}
