// Rows of form factors: what the k-th ray of each node hits, its place in the order of texels. See app/solvers/local/rows.py.
#include "visibility/texel_ray.glsl"

uniform usampler2D t_starts;  // a row for each node: y << 16 | x of the texel from which its k-th ray starts
uniform usampler2D t_places;  // of each texel

layout(location = 0) out uint out_place;

const uint LOST = 0xFFFFFFFFu;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    uint start = texelFetch(t_starts, px, 0).x;
    uint hit = trace(load_origin(ivec2(start & 0xFFFFu, start >> 16)), px.x);
    ivec2 hit_px = texel_px_of(hit);
    out_place = hit_px.y >= u_rows ? LOST : texelFetch(t_places, hit_px, 0).x;
}
