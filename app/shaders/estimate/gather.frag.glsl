// What a ray of a node brings of its irradiance [W/m²]: B of what it meets, and light of a point on a lamp,
//
//     H'(x) = ∫ B(y) cos θ dω / π     two estimates of what comes from lamps and sky, weighed by the balance heuristic [Veach95]
//
// Lamps are chosen by the power of their triangles, points on them evenly.
#define SKY 0
#define LIGHTS 0  // 1: there are lamps without area, or a sun
#include "common/hemisphere.glsl"
#include "estimate/node.glsl"
#include "estimate/surface.glsl"

#if SKY
#include "direct_light/sky_sample.glsl"
uniform vec3 u_sky;           // scale of its map [W/(sr m²)]
#endif
#if LIGHTS
#include "direct_light/light_sample.glsl"
uniform int u_lights;  // how many
uniform int u_rays;    // of a node
#endif
uniform sampler2D t_lamps;  // a triangle each: share of the power up to it, slot
uniform int u_lamps;
uniform float u_power;  // Σ strength · area of them [W/m² · solver space]

layout(location = 0) out vec4 out_light;  // a: mean of its colours, of what comes from lamps without a bounce

const int LAMP_BITS = 10;  // 2^LAMP_BITS of them lie in a row

vec2 lamp(int i) { return texelFetch(t_lamps, ivec2(i & ((1 << LAMP_BITS) - 1), i >> LAMP_BITS), 0).xy; }

// The first lamp whose share of the power reaches u.
int lamp_slot(float u) {
    int low = 0, high = u_lamps - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (lamp(middle).x < u) low = middle + 1;
        else high = middle;
    }
    return int(lamp(low).y);
}

struct Corners { vec3 a, b, c; };

Corners corners_of(int slot) {
    ivec2 px = entry_px(slot, 3);
    return Corners(
        texelFetch(t_bvh_triangles, px, 0).xyz,
        texelFetch(t_bvh_triangles, px + ivec2(1, 0), 0).xyz,
        texelFetch(t_bvh_triangles, px + ivec2(2, 0), 0).xyz
    );
}

vec3 normal_of(Corners t) { return normalize(cross(t.b - t.a, t.c - t.a)); }

// The density per solid angle with which a point on a lamp is chosen, from so far away.
float lamp_density(float strength, float distance, float cosine) {
    return strength / u_power * distance * distance / max(abs(cosine), 1e-9);
}

// The light of the sky from a direction that is chosen by the cosine, or by the sky's light: weighed as that of lamps is.
vec4 from_beyond(Node node, vec3 direction) {
#if SKY
    vec2 uv = sky_uv(direction);
    float cosine = dot(direction, node.normal);
    vec3 E = u_sky * textureLod(t_sky, uv, 0.0).rgb * cosine / (cosine / PI + sky_density(direction, uv));
    return vec4(E, dot(E, vec3(1.0 / 3.0)));
#else
    return vec4(0.0);
#endif
}

vec4 from_sky(Node node, int ray) {
#if SKY
    vec2 share = fract(node.lamp_shift.yz + float(ray) * R2);
    vec3 direction = sky_direction(share);
    vec4 light = vec4(0.0);
    if (dot(direction, node.normal) > 0.0 && !any_hit(node.origin, direction, 0.0, REACH)) light = from_beyond(node, direction);
    return light;
#else
    return vec4(0.0);
#endif
}

vec4 along_cosine(Node node, int ray) {
    vec3 direction = direction_of(node, ray);
    Hit hit = closest_hit(node.origin, direction, 0.0, REACH);
    if (hit.slot < 0) return from_beyond(node, direction);
    Surface seen = surface_of(hit);
    float here = dot(direction, node.normal) / PI;
    float other = lamp_density(seen.strength, hit.distance, dot(normal_of(corners_of(hit.slot)), direction));
    vec3 E = seen.exitance * (here / (here + other));
    return vec4(E + seen.albedo * seen.irradiance, dot(E, vec3(1.0 / 3.0)));
}

vec4 from_lamp(Node node, int ray) {
    if (u_lamps == 0) return vec4(0.0);
    vec3 u = fract(node.lamp_shift + float(ray) * R3);
    int slot = lamp_slot(u.x);
    Corners t = corners_of(slot);
    vec3 normal = normal_of(t);
    float r = sqrt(u.y);
    vec2 weights = r * vec2(1.0 - u.z, u.z);
    vec3 y = t.a + (t.b - t.a) * weights.x + (t.c - t.a) * weights.y;
    bool front = dot(node.origin - y, normal) > 0.0;
    y += (front ? 2.0 : -2.0) * COPLANAR * normal;
    vec3 away = y - node.origin;
    float distance = length(away), cosine = dot(away, node.normal) / distance;
    if (!(cosine > 0.0)) return vec4(0.0);
    Surface seen = surface_of(Hit(distance, slot, weights, front));
    if (seen.exitance == vec3(0.0) || any_hit(node.origin, away, 0.0, 1.0)) return vec4(0.0);
    float here = cosine / PI;
    vec3 E = seen.exitance * (here / (here + lamp_density(seen.strength, distance, dot(normal, away) / distance)));
#if OPACITY
    int row;
    E *= opacity_of(slot, weights, row);
#endif
    return vec4(E, dot(E, vec3(1.0 / 3.0)));
}

// The light of one of the lamps without area: each gets as many rays; where there are more of them than rays, some are chosen.
vec4 from_lights(Node node, int ray) {
#if LIGHTS
    vec3 u = fract(node.lamp_shift + float(ray) * R3);
    int each = u_rays / u_lights, nth = each > 0 ? ray / each : int(u.z * float(u_lights));
    if (nth >= u_lights) return vec4(0.0);
    Light light = load_light(nth);
    float far;
    vec3 way = towards(light, node.origin, u.xy, far), E = unoccluded(light, node.origin, node.normal);
    if (E == vec3(0.0) || dot(way, node.normal) <= 0.0 || any_hit(node.origin, way, 0.0, far)) return vec4(0.0);
    E *= each > 0 ? float(u_rays) / float(each) : float(u_lights);
    return vec4(E, dot(E, vec3(1.0 / 3.0)));
#else
    return vec4(0.0);
#endif
}

void main() {
    Node node = node_of(int(gl_FragCoord.y));
    int ray = int(gl_FragCoord.x);
    out_light = along_cosine(node, ray) + from_lamp(node, ray) + from_sky(node, ray) + from_lights(node, ray);
}
