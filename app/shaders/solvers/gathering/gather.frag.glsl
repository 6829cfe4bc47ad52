// Σ B over some rays of each texel, B = ρH of the texel that was hit: read from where the hits are kept, or traced again. Blended.
#define TRACED 0
#include "visibility/hit.glsl"
#if TRACED
#include "visibility/texel_ray.glsl"
#else
uniform usampler2D t_hits;
uniform ivec3 u_bank;  // size of a page [texels], pages side by side
#endif

uniform sampler2D t_outgoing;
uniform ivec2 u_rays;  // the first, and how many

const int GROUP = 4;  // rays

layout(location = 0) out vec4 out_light;  // a: Σ over groups (Σ mean of RGB)²

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    out_light = vec4(0.0);
    int last = u_rays.x + u_rays.y;
#if TRACED
    Origin o = load_origin(px);
    if (!o.there) return;
#else
    // pages side by side, without a division for each ray
    ivec2 page = u_bank.xy * ivec2(u_rays.x % u_bank.z, u_rays.x / u_bank.z);
    if (texelFetch(t_hits, px + page, 0).x == no_texel(NONE)) last = u_rays.x;  // no texel, and so no ray: nothing to walk through
#endif
    for (int first = u_rays.x; first < last; first += GROUP) {
        vec3 sum = vec3(0.0);
        for (int k = first; k < first + GROUP; ++k) {
#if TRACED
            uint hit = trace(o, k);
#else
            uint hit = texelFetch(t_hits, px + page, 0).x;
            page.x += u_bank.x;
            if (page.x == u_bank.x * u_bank.z) page = ivec2(0, page.y + u_bank.y);
#endif
            sum += texelFetch(t_outgoing, ivec2(hit & 0xFFFFu, hit >> 16), 0).rgb;
        }
        float mean = dot(sum, vec3(1.0 / 3.0));
        out_light += vec4(sum, mean * mean);
    }
}
