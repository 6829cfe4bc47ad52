// PASS shadow rays from each texel, and what they bring: (Σ V w, and Σ over passes of the mean V²), Σ of all w. Blended. Whoever
// includes this says where a ray goes: ray_to.
uniform sampler2D t_passes;  // of PASS shadow rays, that each slot has had
uniform int u_stream;        // of random numbers

layout(location = 0) out vec4 out_seen;
layout(location = 1) out vec4 out_all;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    Origin o = load_origin(px);
    out_seen = out_all = vec4(0.0);
    if (!o.there) return;
    int first = PASS * int(texelFetch(t_passes, px / TILE, 0).r);
    for (int k = first; k < first + PASS; ++k) {
        vec4 share = numbers(o.place, uint(u_stream), k);
        ShadowRay ray = ray_to(start_of(o, share.zw), o.normal, share.xy);
        out_all.rgb += ray.all;
        if (ray.far > 0.0 && !any_hit(ray.from, ray.way, 0.0, ray.far)) out_seen.rgb += ray.brings;
    }
    float all = dot(out_all.rgb, vec3(1.0)), V = all > 0.0 ? dot(out_seen.rgb, vec3(1.0)) / all : 0.0;
    out_seen.a = V * V;
}
