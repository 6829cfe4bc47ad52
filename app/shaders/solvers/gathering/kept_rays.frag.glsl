// The kept rays of one texel, the k-th in the k-th column: where it starts, where it ends, and the light that it brings. No ray is
// traced: what it hit is known by its texel, in whose plane it ends. One that has hit no texel ends far outside.
#include "visibility/hit.glsl"
#include "visibility/origin.glsl"

uniform usampler2D t_hits;
uniform sampler2D t_outgoing;
uniform sampler2D t_position_area;
uniform ivec3 u_bank;  // size of a page [texels], pages side by side
uniform ivec2 u_texel;
uniform int u_first;  // ray of the bank's first page

layout(location = 0) out vec4 out_start;
layout(location = 1) out vec4 out_end;
layout(location = 2) out vec4 out_light;  // B [stored units], of which the mean over all rays is the indirect light

// Along the ray to the plane of a texel; where it grazes that, no farther from its middle than the texel is wide.
float distance_to(ivec2 px, vec3 start, vec3 direction) {
    vec4 there = texelFetch(t_position_area, px, 0);
    if (there.w <= 0.0) return FAR;
    vec3 normal = normal_from_octahedral(texelFetch(t_normal_ids, px, 0).x), way = there.xyz - start;
    float cosine = dot(direction, normal), middle = length(way), edge = sqrt(there.w);
    float plane = abs(cosine) > 1e-3 ? dot(way, normal) / cosine : middle;
    return clamp(plane, middle - edge, middle + edge);
}

void main() {
    int k = int(gl_FragCoord.x), page = k - u_first;
    Origin o = load_origin(u_texel);
    vec3 start, direction;
    kth_ray(o, k, start, direction);
    ivec2 page_px = u_bank.xy * ivec2(page % u_bank.z, page / u_bank.z);
    uint hit = texelFetch(t_hits, u_texel + page_px, 0).x;
    ivec2 px = texel_px_of(hit);
    out_start = vec4(start, 1.0);
    out_end = vec4(start + direction * (px.y >= u_rows ? FAR : distance_to(px, start, direction)), 1.0);
    out_light = vec4(texelFetch(t_outgoing, px, 0).rgb, 1.0);
}
