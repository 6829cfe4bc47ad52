// What a ray meets first, or whether it meets anything: a walk through a bounding volume hierarchy, the near child first. See
// app/visibility/rays.py for the textures. All is in the solver space; distances count in lengths of ``direction``, which may be
// of any length near 1; 0 <= nearest < farthest < 1e30. Triangles block light with both sides; those that are not opaque by chance,
// each by itself: of many rays the right share passes.
//
// Watertight triangles [Woop13]: the triangle is seen along the ray, its corners projected to a plane, where the ray is the
// origin. Edges are decided there by the sign of a difference of two products, which rounding can turn to zero, never to its
// opposite, and which is the same but for its sign for both triangles of an edge; zero is inside. Boxes: a hit that the triangle
// test finds may be three roundings outside of its box [Ize13]; BOX_FAR allows for eight.
#define STACK    // entries: levels of inner nodes in the tree
#define OPACITY 0  // 1: there are triangles that are not opaque
#define BOX_GRID  // 1: boxes are of whole cells of a grid, in half the texels, 0: of floats

uniform usampler2D t_bvh_nodes;     // one texel a child, or two, both children of a node in turn: see app/visibility/bvh_table.py
uniform sampler2D t_bvh_triangles;  // three texels a slot: the corners; a of the first: the triangle in the scene, of
                                    // the second: its row in t_sheer, from 1; 0 where it is opaque
uniform sampler2D t_bvh_uv;         // three texels a slot: at each corner, place in the virtual atlas of the front and of the back

#include "common/sequence.glsl"
#if OPACITY
#include "visibility/opacity.glsl"
#endif

struct Hit {
    float distance;
    int slot;      // in the order of the leaves; negative: nothing was hit
    vec2 weights;  // of corners 1 and 2; corner 0 has the rest
    bool front;
};

const int ROW_BITS = 10;  // 2^ROW_BITS nodes, or slots, lie in a row of their texture
const int COUNT_BITS = 3;  // of a leaf's count, in its name
const float BOX_FAR = 1.0 + 1.0 / 2097152.0;  // 4 ulp
const float ONE_PLACE = 1.0 + 1.0 / 1048576.0;  // of distances: rounding keeps apart what is nearer together
const float LEAST = 1e-24;  // of a component of the direction: 0 times its inverse is 0, and a box's margin times it is beyond all

ivec2 entry_px(int entry, int texels) { return ivec2((entry & ((1 << ROW_BITS) - 1)) * texels, entry >> ROW_BITS); }

// What the triangle test makes of a direction: its largest component is the third axis, along which the others are sheared away.
struct Shear {
    bool first, second;  // whether the first, the second axis is the third one here; the next ones then are the first and second
    vec2 slope;
    float inverse;  // of the component; where it is negative, left and right have changed places
};

vec3 turned(Shear shear, vec3 v) { return shear.first ? v.yzx : shear.second ? v.zxy : v; }

Shear shear_along(vec3 direction) {
    vec3 size = abs(direction);
    bool first = size.x > size.y && size.x > size.z;
    Shear shear = Shear(first, !first && size.y > size.z, vec2(0.0), 0.0);
    vec3 d = turned(shear, direction);
    shear.slope = d.xy / d.z;
    shear.inverse = 1.0 / d.z;
    return shear;
}

vec3 sheared(Shear shear, vec3 v) {
    v = turned(shear, v);
    precise vec3 s = vec3(v.xy - shear.slope * v.z, v.z * shear.inverse);
    return s;
}

float edge(vec2 p, vec2 q) {
    precise float side = p.x * q.y - p.y * q.x;
    return side;
}

#if OPACITY
// Of a triangle that a ray meets there: how much of it is there, 1 where it is opaque.
float opacity_of(int slot, vec2 weights, out int row) {
    ivec2 px = entry_px(slot, 3);
    vec4 second = texelFetch(t_bvh_triangles, px + ivec2(1, 0), 0);
    row = int(second.w) - 1;
    if (row < 0) return 1.0;
    vec3 first = texelFetch(t_bvh_triangles, px, 0).xyz, third = texelFetch(t_bvh_triangles, px + ivec2(2, 0), 0).xyz;
    return opacity_at(row, first + (second.xyz - first) * weights.x + (third - first) * weights.y);
}

bool passes(int slot, vec2 weights, vec3 origin, Shear shear) {
    int row;
    float opacity = opacity_of(slot, weights, row);
    return row >= 0 && chance(origin, vec3(shear.slope, shear.inverse), row) >= opacity;
}
#endif

// Replaces ``hit`` where the triangle of a slot is met after ``nearest`` and before it. Of two in one place, back to back, the one that
// faces the ray is met: the back of one with a single side is black.
void meet(inout Hit hit, int slot, vec3 origin, Shear shear, float nearest) {
    ivec2 px = entry_px(slot, 3);
    vec3 a = sheared(shear, texelFetch(t_bvh_triangles, px, 0).xyz - origin);
    vec3 b = sheared(shear, texelFetch(t_bvh_triangles, px + ivec2(1, 0), 0).xyz - origin);
    vec3 c = sheared(shear, texelFetch(t_bvh_triangles, px + ivec2(2, 0), 0).xyz - origin);
    vec3 sides = vec3(edge(c.xy, b.xy), edge(a.xy, c.xy), edge(b.xy, a.xy));
    float sum = sides.x + sides.y + sides.z;  // 0: seen edge-on, or degenerate
    float least = min(sides.x, min(sides.y, sides.z)), most = max(sides.x, max(sides.y, sides.z));
    bool inside = sum != 0.0 && (least >= 0.0 || most <= 0.0);
    sides /= sum;
    float distance = dot(sides, vec3(a.z, b.z, c.z));
    bool front = (sum > 0.0) == (shear.inverse > 0.0);
    float before = hit.slot < 0 || front == hit.front ? 1.0 : front ? ONE_PLACE : 1.0 / ONE_PLACE;
    bool met = inside && distance >= nearest && distance < hit.distance * before;
#if OPACITY
    met = met && !passes(slot, sides.yz, origin, shear);
#endif
    if (met)
        hit = Hit(distance, slot, sides.yz, front);
}

// (first, last) distance within a box; it is met where first <= last.
vec2 within(vec3 lower, vec3 upper, vec3 origin, vec3 inverse, float nearest, float farthest) {
    vec3 p = (lower - origin) * inverse, q = (upper - origin) * inverse;
    vec3 enter = min(p, q), leave = max(p, q);
    return vec2(
        max(max(enter.x, enter.y), max(enter.z, nearest)),
        min(min(leave.x, min(leave.y, leave.z)) * BOX_FAR, farthest)
    );
}

struct Child {
    vec3 lower, upper;  // of its box; of cells, counted from the grid's corner
    int node;           // below zero: a leaf, ~(first slot << COUNT_BITS | triangles)
};

Child load_child(int node, int which) {
#if BOX_GRID
    uvec4 c = texelFetch(t_bvh_nodes, entry_px(node, 2) + ivec2(which, 0), 0);
    return Child(vec3(c.xyz & 0xFFFFu), vec3(c.xyz >> 16), int(c.w));
#else
    ivec2 px = entry_px(node, 4) + ivec2(2 * which, 0);
    uvec4 l = texelFetch(t_bvh_nodes, px, 0), u = texelFetch(t_bvh_nodes, px + ivec2(1, 0), 0);
    return Child(uintBitsToFloat(l.xyz), uintBitsToFloat(u.xyz), int(l.w));
#endif
}

// Loops end where nodes do, not before: a software rasteriser runs what a loop holds once more for all rays when only its test
// comes first. So inner nodes are walked until all rays have a leaf, then triangles until none has.
Hit walk(vec3 origin, vec3 direction, float nearest, float farthest, bool any_will_do) {
    const int DONE = ~0;  // a leaf without triangles
    Hit hit = Hit(farthest, -1, vec2(0.0), false);
    Shear shear = shear_along(direction);
    vec3 box_origin = origin;
    vec3 box_inverse = 1.0 / mix(direction, vec3(LEAST), lessThan(abs(direction), vec3(LEAST)));
#if BOX_GRID
    vec3 corner = uintBitsToFloat(texelFetch(t_bvh_nodes, ivec2(0, 0), 0).xyz);
    vec3 cells = uintBitsToFloat(texelFetch(t_bvh_nodes, ivec2(1, 0), 0).xyz);  // in a length of 1
    box_origin = (origin - corner) * cells;
    box_inverse /= cells;
#endif
    int stack[STACK + 1];
    stack[0] = DONE;
    int top = 1, node = BOX_GRID;  // the entry before the root holds the grid
    do {
        do {
            Child a = load_child(node, 0), b = load_child(node, 1);
            farthest = hit.distance * ONE_PLACE;
            vec2 in_a = within(a.lower, a.upper, box_origin, box_inverse, nearest, farthest);
            vec2 in_b = within(b.lower, b.upper, box_origin, box_inverse, nearest, farthest);
            bool meets_a = in_a.x <= in_a.y, meets_b = in_b.x <= in_b.y;
            bool b_first = meets_b && (!meets_a || in_b.x < in_a.x);
            stack[top] = b_first ? a.node : b.node;
            top += int(meets_a && meets_b);
            node = b_first ? b.node : a.node;
            if (!meets_a && !meets_b) node = stack[--top];
        } while (node >= 0);
        do {
            int first = ~node >> COUNT_BITS, count = ~node & ((1 << COUNT_BITS) - 1);
            if (node != DONE) {
                meet(hit, first + count - 1, origin, shear, nearest);
                node = count > 1 ? node + 1 : stack[--top];
            }
            if (any_will_do && hit.slot >= 0) node = DONE;
        } while (node < DONE);
    } while (node != DONE);
    return hit;
}

Hit closest_hit(vec3 origin, vec3 direction, float nearest, float farthest) {
    return walk(origin, direction, nearest, farthest, false);
}

bool any_hit(vec3 origin, vec3 direction, float nearest, float farthest) {
    return walk(origin, direction, nearest, farthest, true).slot >= 0;
}

// The triangle that was hit, in the scene's order.
int triangle_of(Hit hit) { return int(texelFetch(t_bvh_triangles, entry_px(hit.slot, 3), 0).w); }

// The place in the virtual atlas that was hit [texels of level 0]; its x is negative where that side has no texels: it is black.
vec2 place_of(Hit hit) {
    ivec2 px = entry_px(hit.slot, 3);
    vec4 a = texelFetch(t_bvh_uv, px, 0), b = texelFetch(t_bvh_uv, px + ivec2(1, 0), 0);
    vec4 c = texelFetch(t_bvh_uv, px + ivec2(2, 0), 0);
    vec4 uv = a + (b - a) * hit.weights.x + (c - a) * hit.weights.y;
    return hit.front ? uv.xy : uv.zw;
}
