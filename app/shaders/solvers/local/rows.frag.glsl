// Rows of form factors: what the k-th ray of each node hits, its place in the order of texels. All rays of a node are of one sequence,
// that of the texel where the first one starts. See app/solvers/local/rows.py.
#include "solvers/local/place.glsl"
#include "visibility/texel_ray.glsl"

uniform usampler2D t_starts;  // a row for each node: y << 16 | x of the texel from which its k-th ray starts
uniform usampler2D t_places;  // of each texel

layout(location = 0) out uint out_place;

Origin origin_of(ivec2 px) {
    uint start = texelFetch(t_starts, px, 0).x;
    return load_origin(ivec2(start & 0xFFFFu, start >> 16));
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    Origin o = origin_of(px);
    o.place = origin_of(ivec2(0, px.y)).place;
    uint hit = trace(o, px.x);
    ivec2 hit_px = texel_px_of(hit);
    out_place = hit_px.y >= u_rows ? LOST : texelFetch(t_places, hit_px, 0).x;
}
