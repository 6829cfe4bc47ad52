// What a ray meets first, or whether it meets anything: a walk through a bounding volume hierarchy, the near child first. See
// app/visibility/rays.py for the textures. All is in the solver space; distances count in lengths of ``direction``, which may be
// of any length near 1; 0 <= nearest < farthest < 1e30. Triangles block light with both sides.
//
// Watertight triangles [Woop13]: the triangle is seen along the ray, its corners projected to a plane, where the ray is the
// origin. Edges are decided there by the sign of a difference of two products, which rounding can turn to zero, never to its
// opposite, and which is the same but for its sign for both triangles of an edge; zero is inside. Boxes: a hit that the triangle
// test finds may be three roundings outside of its box [Ize13]; BOX_FAR allows for eight.
//
// [Woop13] S. Woop, C. Benthin, I. Wald, Watertight ray/triangle intersection, JCGT 2(1), 2013.
// [Ize13] T. Ize, Robust BVH ray traversal, JCGT 2(2), 2013.
#define STACK  // entries: levels of inner nodes in the tree

uniform sampler2D t_bvh_nodes;      // four texels a node: both children, (lower, reference), (upper, count)
uniform sampler2D t_bvh_triangles;  // three texels a slot: the corners; a of the first: the triangle in the scene
uniform sampler2D t_bvh_uv;         // three texels a slot: at each corner, place in the virtual atlas of the front and of the back

struct Hit {
    float distance;
    int slot;      // in the order of the leaves; negative: nothing was hit
    vec2 weights;  // of corners 1 and 2; corner 0 has the rest
    bool front;
};

const int ROW_BITS = 10;  // 2^ROW_BITS nodes, or slots, lie in a row of their texture
const int COUNT_BITS = 3;  // of a leaf's count, on the stack
const float BOX_FAR = 1.0 + 1.0 / 2097152.0;  // 4 ulp
const float LEAST = 1e-24;  // of a component of the direction: 0 times its inverse is 0, and a box's margin times it is beyond all

ivec2 entry_px(int entry, int texels) { return ivec2((entry & ((1 << ROW_BITS) - 1)) * texels, entry >> ROW_BITS); }

// What the triangle test makes of a direction: rows of the shear that turns it into the third axis.
mat3 sheared_from_local(vec3 direction) {
    vec3 size = abs(direction);
    vec3 z = size.x > size.y && size.x > size.z ? vec3(1, 0, 0) : size.y > size.z ? vec3(0, 1, 0) : vec3(0, 0, 1);
    vec3 x = z.zxy, y = z.yzx;
    float along = 1.0 / dot(direction, z);
    x -= z * (dot(direction, x) * along);
    y -= z * (dot(direction, y) * along);
    return transpose(along < 0.0 ? mat3(y, x, z * along) : mat3(x, y, z * along));
}

vec3 sheared(mat3 sheared_from_local, vec3 v) {
    precise vec3 s = sheared_from_local * v;
    return s;
}

float edge(vec2 p, vec2 q) {
    precise float side = p.x * q.y - p.y * q.x;
    return side;
}

// Replaces ``hit`` where the triangle of a slot is met after ``nearest`` and before it.
void meet(inout Hit hit, int slot, vec3 origin, mat3 sheared_from_local, float nearest) {
    ivec2 px = entry_px(slot, 3);
    vec3 a = sheared(sheared_from_local, texelFetch(t_bvh_triangles, px, 0).xyz - origin);
    vec3 b = sheared(sheared_from_local, texelFetch(t_bvh_triangles, px + ivec2(1, 0), 0).xyz - origin);
    vec3 c = sheared(sheared_from_local, texelFetch(t_bvh_triangles, px + ivec2(2, 0), 0).xyz - origin);
    vec3 sides = vec3(edge(c.xy, b.xy), edge(a.xy, c.xy), edge(b.xy, a.xy));
    if (any(lessThan(sides, vec3(0.0))) && any(greaterThan(sides, vec3(0.0)))) return;
    float sum = sides.x + sides.y + sides.z;
    if (sum == 0.0) return;  // seen edge-on, or degenerate
    sides /= sum;
    float distance = dot(sides, vec3(a.z, b.z, c.z));
    if (distance >= nearest && distance < hit.distance) hit = Hit(distance, slot, sides.yz, sum > 0.0);
}

// (first, last) distance within a box; it is met where first <= last.
vec2 within(vec3 lower, vec3 upper, vec3 origin, vec3 inverse, float nearest, float farthest) {
    vec3 p = (lower - origin) * inverse, q = (upper - origin) * inverse;
    vec3 enter = min(p, q), leave = max(p, q);
    return vec2(
        max(max(enter.x, enter.y), max(enter.z, nearest)),
        min(min(leave.x, leave.y) * BOX_FAR, min(leave.z * BOX_FAR, farthest))
    );
}

// A child as one number: an inner node, or below zero a leaf.
int child(float reference, float count) {
    return count > 0.0 ? ~(int(reference) << COUNT_BITS | int(count)) : int(reference);
}

Hit walk(vec3 origin, vec3 direction, float nearest, float farthest, bool any_will_do) {
    Hit hit = Hit(farthest, -1, vec2(0.0), false);
    mat3 sheared_from_local = sheared_from_local(direction);
    vec3 inverse = 1.0 / mix(direction, vec3(LEAST), lessThan(abs(direction), vec3(LEAST)));
    int stack[STACK];
    int top = 0, node = 0;
    while (true) {
        bool next = true;
        if (node >= 0) {
            ivec2 px = entry_px(node, 4);
            vec4 lower_0 = texelFetch(t_bvh_nodes, px, 0), upper_0 = texelFetch(t_bvh_nodes, px + ivec2(1, 0), 0);
            vec4 lower_1 = texelFetch(t_bvh_nodes, px + ivec2(2, 0), 0), upper_1 = texelFetch(t_bvh_nodes, px + ivec2(3, 0), 0);
            vec2 in_0 = within(lower_0.xyz, upper_0.xyz, origin, inverse, nearest, hit.distance);
            vec2 in_1 = within(lower_1.xyz, upper_1.xyz, origin, inverse, nearest, hit.distance);
            bool meets_0 = in_0.x <= in_0.y, meets_1 = in_1.x <= in_1.y;
            bool first_1 = meets_1 && (!meets_0 || in_1.x < in_0.x);
            int child_0 = child(lower_0.w, upper_0.w), child_1 = child(lower_1.w, upper_1.w);
            if (meets_0 && meets_1) stack[top++] = first_1 ? child_0 : child_1;
            next = !(meets_0 || meets_1);
            node = first_1 ? child_1 : child_0;
        } else {
            int first = ~node >> COUNT_BITS, end = first + (~node & ((1 << COUNT_BITS) - 1));
            for (int slot = first; slot < end; ++slot) meet(hit, slot, origin, sheared_from_local, nearest);
            if (any_will_do && hit.slot >= 0) break;
        }
        if (next) {
            if (top == 0) break;
            node = stack[--top];
        }
    }
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
