// Shadow rays to the lamps of a set, and what they bring [Veach97, 8.2]: a lamp is chosen by what it may give to this cell of texels,
// a point on it evenly as seen from here. With w = F_dA / p, what the lamp's point would give unoccluded, over its probability density:
//
//   CLOSED_FORM:  (Σ w V, Σ w, Σ over passes (Σ w V / Σ w)²): Σ F V is then the closed form Σ F times Σ w V / Σ w
//   else:         (Σ w V E, Σ over passes (mean of w V E over RGB)²), E relative to that of the set
//
// Blended.
#define CLOSED_FORM 1
#define PASS  // shadow rays
#include "direct_light/lamp.glsl"
#include "visibility/origin.glsl"
#include "visibility/rays.glsl"
#if PICTURE
#include "common/texel_at.glsl"
uniform sampler2D t_emission;
#endif

uniform sampler2D t_near;    // folded: NEAR lamps of each cell, their chances summed up, and which they are
uniform sampler2D t_far;     // folded: chances of all lamps, summed up
uniform sampler2D t_passes;   // of PASS shadow rays, that each slot has had
uniform int u_stream;         // of random numbers

layout(location = 0) out vec4 out_direct;

const int CELL = 4;   // texels along its edge
const int NEAR = 32;  // lamps of each cell

// The entry of a table, of ``count`` from ``first`` on, in whose share a number lies; its share, and where in it that lies.
int chosen(sampler2D table, int first, int count, float number, out float share, out float rest) {
    int low = 0, high = count - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (number < texelFetch(table, folded(first + middle), 0).r) high = middle; else low = middle + 1;
    }
    float before = low == 0 ? 0.0 : texelFetch(table, folded(first + low - 1), 0).r;
    share = texelFetch(table, folded(first + low), 0).r - before;
    rest = clamp((number - before) / max(share, 1e-30), 0.0, 0.999999);
    return first + low;
}

// A lamp for a number in [0, 1): one of those of the cell, or any other; then its probability, else -1.
int chosen_lamp(int cell, float number, out float probability, out float rest) {
    int known = min(NEAR, u_lamps);
    float near = texelFetch(t_near, folded(cell * NEAR + known - 1), 0).r;
    if (number < near) {
        int entry = chosen(t_near, cell * NEAR, known, number, probability, rest);
        return int(texelFetch(t_near, folded(entry), 0).g);
    }
    int nth = chosen(t_far, 0, u_lamps, (number - near) / (1.0 - near), probability, rest);
    probability *= 1.0 - near;
    int low = 0, high = NEAR - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (int(texelFetch(t_near, folded(cell * NEAR + middle), 0).g) < nth) low = middle + 1; else high = middle;
    }
    return int(texelFetch(t_near, folded(cell * NEAR + low), 0).g) == nth ? -1 : nth;
}

// Of a point on a lamp, ``way`` from its corner: what its exitance is multiplied with.
vec3 picture(int nth, Lamp lamp, vec3 normal, vec3 way, bool front) {
#if PICTURE
    vec2 weights = vec2(dot(cross(way, lamp.v), normal), dot(cross(lamp.u, way), normal)) / (2.0 * lamp.area);
    vec4 a = lamp_texel(nth, 4), b = lamp_texel(nth, 5), c = lamp_texel(nth, 6);
    vec4 place = a + (b - a) * weights.x + (c - a) * weights.y;
    vec2 uv = front ? place.xy : place.zw;
    ivec2 px = uv.x < 0.0 ? ivec2(-1) : texel_px_at(uv);
    return px.y < 0 ? vec3(0.0) : texelFetch(t_emission, px, 0).rgb;
#else
    return vec3(1.0);
#endif
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    Origin o = load_origin(px);
    out_direct = vec4(0.0);
    if (!o.there) return;
    ivec2 slot = px / TILE;
    ivec2 within = px % TILE / CELL;
    int cell = (slot.y * textureSize(t_leaves, 0).x + slot.x) * (TILE / CELL) * (TILE / CELL) + within.y * (TILE / CELL) + within.x;
    float all = 0.0;
    vec3 seen = vec3(0.0);
    int first = PASS * int(texelFetch(t_passes, slot, 0).r);
    for (int k = first; k < first + PASS; ++k) {
        vec4 share = numbers(o.place, uint(u_stream), k);
        float probability, rest;
        int nth = chosen_lamp(cell, share.x, probability, rest);
        if (nth < 0) continue;
        Lamp lamp = load_lamp(nth);
        vec3 normal = cross(lamp.u, lamp.v) / (2.0 * lamp.area);
        vec3 from = start_of(o, share.zw);
        float area;
        vec3 point = point_on(lamp, normal, from, vec2(rest, share.y), area), way = point - from;
        float side = dot(way, normal) < 0.0 ? 1.0 : -1.0;
        if (side < 0.0 && !lamp.two_sided) continue;
        float r2 = dot(way, way);
        float cosines = dot(way, o.normal) * abs(dot(way, normal));
        if (cosines <= 0.0 || probability <= 0.0) continue;
        float w = cosines * area / (PI * r2 * r2 * probability);
        all += w;
        way += 2.0 * COPLANAR * side * normal;  // off the lamp's own surface
        float r = length(way);
        if (!any_hit(from, way / r, 0.0, r)) seen += w * lamp.exitance * picture(nth, lamp, normal, point - lamp.corner, side > 0.0);
    }
#if CLOSED_FORM
    float V = all > 0.0 ? seen.x / all : 0.0;
    out_direct = vec4(seen.x, all, V * V, 0.0);
#else
    float mean = dot(seen, vec3(1.0 / 3.0)) / float(PASS);
    out_direct = vec4(seen, mean * mean);
#endif
}
