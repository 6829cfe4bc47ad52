// Where rays of a texel start: anywhere on its square where one flat surface fills it, so that the mean over its rays is that over
// its area; else in the middle of the surface that it covers.
#include "common/atlas.glsl"
#include "common/facet.glsl"
#include "common/hemisphere.glsl"
#include "common/item.glsl"
#include "common/leaves.glsl"
#include "common/sequence.glsl"
#include "common/tile.glsl"

uniform sampler2D t_origin;  // point, solver space; w: 0 nothing here, 1 that point, 2 all of the square around it
uniform usampler2D t_origin_normal;
uniform usampler2D t_normal_ids;

struct Origin {
    vec3 position;
    vec3 normal;
    bool there;
    bool square;
    vec3 u, v;    // along the edges of the square
    ivec3 place;  // of the texel in the atlas, for its random numbers
};

Origin load_origin(ivec2 texel_px) {
    Origin o;
    vec4 p = texelFetch(t_origin, texel_px, 0);
    o.there = p.w > 0.0;
    o.square = p.w > 1.5;
    o.normal = normal_from_octahedral(texelFetch(t_origin_normal, texel_px, 0).x);
    o.position = p.xyz + 2.0 * COPLANAR * o.normal;
    vec3 leaf = texelFetch(t_leaves, texel_px / TILE, 0).xyz;
    o.place = ivec3(ivec2(leaf.xy) * TILE + texel_px % TILE, int(1.0 / max(leaf.z, 1e-6)));
    o.u = o.v = vec3(0.0);
    if (o.square) {
        uint facet = facet_from_ids(texelFetch(t_normal_ids, texel_px, 0).y);
        o.u = facet_entry(facet, 0).xyz * leaf.z;
        o.v = facet_entry(facet, 1).xyz * leaf.z;
    }
    return o;
}

vec3 start_of(Origin o, vec2 share) { return o.position + (share.x - 0.5) * o.u + (share.y - 0.5) * o.v; }

const uint GATHER = 0u;  // stream of random numbers

// The k-th ray of a texel, the same whenever it is asked for. [Kahl22]
void kth_ray(Origin o, int k, out vec3 start, out vec3 direction) {
    vec4 share = numbers(o.place, GATHER, k);
    start = start_of(o, share.zw);
    direction = cosine_direction(o.normal, share.xy);
}
