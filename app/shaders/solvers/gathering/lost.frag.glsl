// How many of some kept rays of each texel left the scene (r), and how many met sides without texels, which are black (g). Blended.
#include "visibility/hit.glsl"

uniform usampler2D t_hits;
uniform ivec3 u_bank;  // size of a page [texels], pages side by side
uniform ivec2 u_rays;   // the first, and how many

layout(location = 0) out vec2 out_lost;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    out_lost = vec2(0.0);
    for (int k = u_rays.x; k < u_rays.x + u_rays.y; ++k) {
        uint hit = texelFetch(t_hits, px + u_bank.xy * ivec2(k % u_bank.z, k / u_bank.z), 0).x;
        out_lost += vec2(hit == no_texel(ESCAPED), hit == no_texel(BLACK));
    }
}
