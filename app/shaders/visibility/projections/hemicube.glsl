// The hemicube [Cohen85]: five perspective views from the shooter, packed into one map of 3R×R texels, drawn at once.
//
//   +-------+----+----+     view 0: top, R×R            local frame: +z is the shooter's normal, the origin its position
//   |  top  | 2  | 4  |     views 1..4: +x -x +y -y,    in a view: a to the right, b up, w the depth along its axis
//   |   0   |----+----|     R×R/2, only above z = 0
//   |       | 1  | 3  |
//   +-------+----+----+
#define RESOLUTION 256

const float R = float(RESOLUTION);
const float HALF_R = 0.5 * R;
const vec2 MAP_PX = vec2(3.0, 1.0) * R;

// (a, b, w) of a local vector; a × b = -w keeps the winding of triangles
vec3 view_from_local(int view, vec3 v) {
    vec2 side = view > 2 ? vec2(v.x, v.y) : vec2(-v.y, v.x);  // (a, w) of +y and of +x; the opposite view negates both
    side *= (view & 1) == 0 ? -1.0 : 1.0;
    return view == 0 ? vec3(v.x, -v.y, v.z) : vec3(side.x, v.z, side.y);
}

vec3 local_from_view(int view, vec3 v) {
    vec2 side = (view & 1) == 0 ? -v.xz : v.xz;
    return view == 0 ? vec3(v.x, -v.y, v.z) : view > 2 ? vec3(side.x, side.y, v.y) : vec3(side.y, -side.x, v.y);
}

// where a / w = b / w = 0 lies in the map; the sides keep only b >= 0
vec2 view_origin_px(int view) {
    int side = view - 1;
    return view == 0 ? vec2(HALF_R) : vec2(R * (1.5 + float(side >> 1)), HALF_R * float(side & 1));
}

// lower and upper corner of a view in the map
vec4 view_bounds_px(int view) {
    vec2 origin = view_origin_px(view);
    return vec4(origin.x - HALF_R, view == 0 ? 0.0 : origin.y, origin + HALF_R);
}

int view_from_direction(vec3 local) {
    vec3 m = abs(local);
    int side = m.x >= m.y ? (local.x > 0.0 ? 1 : 2) : (local.y > 0.0 ? 3 : 4);
    return local.z >= max(m.x, m.y) ? 0 : side;
}

int view_from_px(vec2 px) {
    return px.x < R ? 0 : 1 + 2 * int(px.x >= 2.0 * R) + int(px.y >= HALF_R);
}

// Depth grows along a sight: point = depth · (sight of its texel), in the view's axes.
float depth_from_view(vec3 v) { return v.z; }
vec2 px_from_view(int view, vec3 v) { return view_origin_px(view) + HALF_R * v.xy / v.z; }
vec3 sight_from_px(int view, vec2 px) { return vec3((px - view_origin_px(view)) / HALF_R, 1.0); }

// dot(sight, n) of the 2×2 texels around px, in the order of textureGather
vec4 sights_dot(int view, vec2 px, vec3 n) {
    vec2 step = 0.5 * n.xy / HALF_R;
    return dot(sight_from_px(view, px), n) + vec4(step.y - step.x, step.y + step.x, step.x - step.y, -step.x - step.y);
}

// 1 for each of these that lies on the hemisphere
vec4 on_hemisphere(vec2 px) { return vec4(1.0); }

// Solid-angle weight cosθ dω / π of the map's texel at px: sums to 1 over the map. [Cohen85, delta form factors]
float delta_form_factor(int view, vec2 px) {
    vec3 sight = sight_from_px(view, px);
    float r2 = dot(sight, sight);
    return local_from_view(view, sight).z / (3.14159265358979 * r2 * r2 * HALF_R * HALF_R);
}
