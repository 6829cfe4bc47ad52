// Draws the hemisphere exactly: around the image of each triangle a larger one is drawn, whose fragments are tested against the
// true triangle. [Gascuel08]
//
// Great circles become circles of radius 1 / |n.z|, n their plane's normal. Where an edge bulges outward, it lies between its
// chord and the tangents at its ends: the corners, and where these tangents meet, span what holds the image.
#include "common/item.glsl"
#include "visibility/projections/hemisphere.glsl"
#include "visibility/projections/triangles.glsl"

uniform sampler2D t_triangles;

out gl_PerVertex {
    vec4 gl_Position;
    float gl_ClipDistance[4];
};
flat out vec3 v_edge_a;  // inward unit normals of the planes through shooter and edge
flat out vec3 v_edge_b;
flat out vec3 v_edge_c;
flat out vec4 v_plane;
flat out float v_item;

const float MARGIN = 0.125 / R;  // GL rounds places in the map to a sixteenth of a texel, or better

struct Edge {
    vec2 from, to;   // in the disc, what is above the horizon
    vec2 outward;    // unit normal
    float sagitta;   // of the bulge
    vec2 apex;       // where the tangents at its ends meet
    vec2 cut;        // where the horizon cuts it, or 0
    vec3 inward;     // unit normal of its plane
};

// turn: 1 where the triangle's corners run counter-clockwise as seen from the shooter, else -1
Edge edge_from(vec3 a, vec3 b, float turn) {
    Edge e;
    e.inward = turn * cross(a, b);
    e.inward /= max(length(e.inward), 1e-30);
    e.from = disc_from_local(a);
    e.to = disc_from_local(b);
    e.cut = vec2(0.0);
    if ((a.z < 0.0) != (b.z < 0.0)) {
        e.cut = normalize(mix(a.xy, b.xy, a.z / (a.z - b.z)));
        if (a.z < 0.0) e.from = e.cut; else e.to = e.cut;
    }
    vec2 chord = e.to - e.from;
    float h = 0.5 * length(chord), sine = h * max(e.inward.z, 0.0), cosine = sqrt(max(1.0 - sine * sine, 1e-6));
    e.outward = turn * vec2(chord.y, -chord.x) / max(2.0 * h, 1e-30);
    e.sagitta = h * sine / (1.0 + cosine);
    e.apex = 0.5 * (e.from + e.to) + e.outward * h * sine / cosine;
    return e;
}

// How far the image reaches beyond the chord of k: by its own bulge, or those of the others.
float reach(Edge k, Edge i, Edge j) {
    return MARGIN + max(k.sagitta, max(dot(k.outward, i.apex - k.from), dot(k.outward, j.apex - k.from)));
}

void grow(inout vec4 box, Edge e, vec3 a, vec3 b) {
    if (max(a.z, b.z) < 0.0) return;
    box = vec4(min(box.xy, min(e.from, e.to) - e.sagitta), max(box.zw, max(e.from, e.to) + e.sagitta));
}

// This corner of a triangle that covers the image.
vec2 covering(Triangle t, Edge ab, Edge bc, Edge ca, int corner) {
    vec4 box = vec4(1.0, 1.0, -1.0, -1.0);
    grow(box, ab, t.a, t.b);
    grow(box, bc, t.b, t.c);
    grow(box, ca, t.c, t.a);
    bool cut = min(t.a.z, min(t.b.z, t.c.z)) < 0.0;
    // cut by the horizon, it ends on an arc of the rim
    float rim = cut ? 1.0 - 0.5 * length(ab.cut + bc.cut + ca.cut) : 0.0;
    vec2 low = max(box.xy - rim - MARGIN, -1.0), size = min(box.zw + rim + MARGIN, 1.0) - low;

    // the chords' triangle, each side moved outward by its reach; in barycentric coordinates
    vec3 height = vec3(dot(ab.outward, ab.from - bc.to), dot(bc.outward, bc.from - ca.to), dot(ca.outward, ca.from - ab.to));
    vec3 beyond = vec3(reach(ab, bc, ca), reach(bc, ca, ab), reach(ca, ab, bc)) / height;
    float scale = 1.0 + beyond.x + beyond.y + beyond.z;
    if (!cut && min(height.x, min(height.y, height.z)) > 0.0 &&
        0.25 * height.x * distance(ab.from, ab.to) * scale * scale < size.x * size.y) {
        vec3 at = -beyond.yzx;  // of a, b, c: the side opposite to it
        at[corner] += scale;
        return at.x * ab.from + at.y * bc.from + at.z * ca.from;
    }
    return low + 2.0 * size * vec2(corner & 1, corner >> 1);
}

void draw(int view, vec3 origin, mat3 axes, float facet, int shot, int shots) {
    int id = gl_VertexID / 3;
    Triangle t = seen_from(load_triangle(t_triangles, id), origin, axes);
    v_plane = plane_of(t);
    v_item = v_plane.w < 0.0 ? t.sides.r : t.sides.g;
    float turn = sign(v_plane.w);
    Edge ab = edge_from(t.a, t.b, turn), bc = edge_from(t.b, t.c, turn), ca = edge_from(t.c, t.a, turn);
    v_edge_a = ab.inward;
    v_edge_b = bc.inward;
    v_edge_c = ca.inward;
    vec2 p = unseen(t, v_plane, facet) ? vec2(2.0) : covering(t, ab, bc, ca, gl_VertexID - 3 * id);
    gl_Position = vec4(p.x, (p.y + 1.0 + 2.0 * float(shot)) / float(shots) - 1.0, 0.0, 1.0);
    gl_ClipDistance[0] = 1.0 + p.x;
    gl_ClipDistance[1] = 1.0 - p.x;
    gl_ClipDistance[2] = 1.0 + p.y;
    gl_ClipDistance[3] = 1.0 - p.y;
}
