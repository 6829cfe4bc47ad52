// The receiver pass without its arithmetic: for the same texels and shots, all that shooting/receive.frag.glsl reads is read, and
// added so faintly that the light stays what it is. What this takes is what memory takes of that pass.
#define PLANAR 1
#define VISIBILITY 2
#include "common/atlas.glsl"
#include "common/albedo.glsl"

const float FAINT = 1e-30;

uniform vec2 u_size;  // of the tile pool [texels]
uniform sampler2D t_items;
#if VISIBILITY != 0
uniform sampler2D t_depth;
#endif

flat in uint v_shots;
#if PLANAR
in vec3 v_position;
flat in vec3 v_albedo;
#else
uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
#endif

layout(location = 0) out vec4 out_irradiance;
layout(location = 1) out vec4 out_residual;

void main() {
    ivec2 texel_px = ivec2(gl_FragCoord.xy);
#if PLANAR
    vec4 read = vec4(v_position, 0.0);
    vec3 albedo = v_albedo * albedo_texture(texel_px);
#else
    uvec2 normal_ids = texelFetch(t_normal_ids, texel_px, 0).xy;
    vec4 read = texelFetch(t_position_area, texel_px, 0) + vec4(normal_ids, 0.0, 0.0);
    vec3 albedo = albedo_of(t_materials, material_from_ids(normal_ids.y), texel_px);
#endif
    vec2 uv = gl_FragCoord.xy / u_size;  // neighbours look up what lies side by side, as there
    for (uint shots = v_shots; shots != 0u; shots &= shots - 1u) {
        read += textureGather(t_items, uv);
#if VISIBILITY != 0
        read += textureGather(t_depth, uv);
#endif
        uv.y = fract(uv.y + 1.0 / 8.0);  // the map of another shot
    }
    out_irradiance = FAINT * read;
    out_residual = FAINT * vec4(albedo, read.w);
}
