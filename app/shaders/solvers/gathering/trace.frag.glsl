// What the rays of texels hit: pages side by side, the k-th ray of each texel in the k-th page.
#include "visibility/texel_ray.glsl"

uniform int u_first;    // ray of the first page
uniform ivec3 u_bank;  // size of a page [texels], pages side by side

layout(location = 0) out uint out_hit;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy), page = px / u_bank.xy;
    Origin o = load_origin(px - page * u_bank.xy);
    out_hit = o.there ? trace(o, u_first + page.y * u_bank.z + page.x) : no_texel(NONE);
}
