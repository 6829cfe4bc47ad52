// The direct light of the sky, U Σ w V / Σ w, as its shadow rays have it so far. Blended.
#define GATHERED 0  // 1: as what SKY_RAYS rays have gathered, see solvers/gathering/gather.frag.glsl
#include "common/atlas.glsl"
#include "common/tile.glsl"
uniform sampler2D t_seen;  // see rays_loop.glsl
uniform sampler2D t_all;
uniform sampler2D t_unoccluded;  // U by normal, on the nodes of the octahedron's square
uniform usampler2D t_origin_normal;
uniform sampler2D t_passes;  // that each slot has had
uniform vec3 u_scale;        // of the sky [stored units]

layout(location = 0) out vec4 out_direct;  // a: variance of the mean of RGB

const float SKY_RAYS = 8.0;  // two groups of four
const int NORMALS = 33;  // along the edge of the square: odd, so that axes are nodes

vec2 octahedral(vec3 n) {
    n /= abs(n.x) + abs(n.y) + abs(n.z);
    return n.z >= 0.0 ? n.xy : (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    vec4 seen = texelFetch(t_seen, px, 0);
    vec3 all = texelFetch(t_all, px, 0).rgb, normal = normal_from_octahedral(texelFetch(t_origin_normal, px, 0).x);
    float passes = max(texelFetch(t_passes, px / TILE, 0).r, 1.0);
    vec2 uv = ((0.5 * octahedral(normal) + 0.5) * float(NORMALS - 1) + 0.5) / float(NORMALS);
    vec3 U = u_scale * textureLod(t_unoccluded, uv, 0.0).rgb;
    float mean = dot(U, vec3(1.0 / 3.0)), sum = dot(all, vec3(1.0)), V = sum > 0.0 ? dot(seen.rgb, vec3(1.0)) / sum : 0.0;
    float spread = max(seen.a / passes - V * V, 0.0);
    out_direct = vec4(U * seen.rgb / max(all, vec3(1e-30)), mean * mean * spread / max(passes - 1.0, 1.0));
#if GATHERED
    float light = dot(out_direct.rgb, vec3(1.0 / 3.0));
    out_direct = vec4(out_direct.rgb * SKY_RAYS, 0.5 * SKY_RAYS * SKY_RAYS * (out_direct.a + light * light));
#endif
}
