// The hemisphere around the shooter's normal in one view, stereographic: p = v.xy / (|v| + v.z) fills the unit disc of a map of
// 2R×2R texels. A texel at the pole is as large as the hemicube's, 4/R² sr, and a fourth of that at the rim. Great circles
// become circles: with n the normal of such a plane, of centre n.xy / n.z and radius 1 / |n.z|. [Wallner10, 5]
// Texels outside of the disc weigh nothing and are never looked up.
#define RESOLUTION 256

const float R = float(RESOLUTION);
const vec2 MAP_PX = vec2(2.0 * R);
const float LOOKUP_R = R - 0.70710678;  // a place this far from the centre has its nearest texel in the disc

vec2 disc_from_local(vec3 v) { return v.xy / max(length(v) + v.z, 1e-30); }
vec2 px_from_disc(vec2 p) { return R + R * p; }

vec3 view_from_local(int view, vec3 v) { return v; }
vec3 local_from_view(int view, vec3 v) { return v; }
vec4 view_bounds_px(int view) { return vec4(0.0, 0.0, MAP_PX); }
int view_from_direction(vec3 local) { return 0; }
int view_from_px(vec2 px) { return 0; }

// Depth is the distance: point = depth · (sight of its texel).
float depth_from_view(vec3 v) { return length(v); }

vec2 px_from_view(int view, vec3 v) {
    vec2 p = disc_from_local(v);
    return R + p * min(R, LOOKUP_R / max(length(p), 1e-30));
}

vec3 sight_from_px(int view, vec2 px) {
    vec2 p = px / R - 1.0;
    float r2 = dot(p, p);
    return vec3(2.0 * p, 1.0 - r2) / (1.0 + r2);
}

// the 2×2 texels around px, in the order of textureGather
vec4 four_x(vec2 px) { return (px.x + vec4(-0.5, 0.5, 0.5, -0.5)) / R - 1.0; }
vec4 four_y(vec2 px) { return (px.y + vec4(0.5, 0.5, -0.5, -0.5)) / R - 1.0; }

// dot(sight, n) of each
vec4 sights_dot(int view, vec2 px, vec3 n) {
    vec4 x = four_x(px), y = four_y(px), r2 = x * x + y * y;
    return (2.0 * (x * n.x + y * n.y) + (1.0 - r2) * n.z) / (1.0 + r2);
}

// 1 for each that lies on the hemisphere
vec4 on_hemisphere(vec2 px) {
    vec4 x = four_x(px), y = four_y(px);
    return vec4(lessThan(x * x + y * y, vec4(1.0)));
}

// Solid-angle weight cosθ dω / π of the map's texel at px: sums to 1 over the map.
float delta_form_factor(int view, vec2 px) {
    vec2 p = px / R - 1.0;
    float r2 = dot(p, p), d = 1.0 + r2;
    return max(1.0 - r2, 0.0) * 4.0 / (3.14159265358979 * d * d * d * R * R);
}
