// The virtual atlas as a picture: the display texels of its leaves. Those of a quadtree are framed in the colour of their level,
// tinted with it where they are too small for a frame, and shine when they are new.
#include "render/shine.glsl"
#include "render/places.glsl"
uniform sampler2D t_display;   // developed for the screen
uniform vec3 u_texel;          // size of a display texel; pages per texel of level 0
uniform vec2 u_atlas_per_px;   // texels of level 0
uniform float u_leaves;        // 1 for a quadtree
uniform float u_tile;          // texels along the edge of a leaf
uniform float u_turned;        // 1: v to the right and u up

const vec3 NOTHING = vec3(0.114, 0.114, 0.122);  // the panel behind it
const int SAMPLES = 2;  // per pixel along each axis

layout(location = 0) out vec4 out_colour;

// [texels of level 0]
vec2 uv_at(vec2 px) { return mix(px, px.yx, u_turned) * u_atlas_per_px; }

vec4 place_at(vec2 uv) { return place_of(ivec2(uv * u_texel.z)); }

void main() {
    vec3 colour = vec3(0.0);
    for (int k = 0; k < SAMPLES * SAMPLES; ++k) {
        vec2 uv = uv_at(floor(gl_FragCoord.xy) + (vec2(k % SAMPLES, k / SAMPLES) + 0.5) / float(SAMPLES));
        vec4 place = place_at(uv);
        vec4 texel = textureLod(t_display, (uv * place.z + place.xy) * u_texel.xy, 0.0);
        colour += mix(NOTHING, texel.rgb, place.z > 0.0 ? texel.a : 0.0) / float(SAMPLES * SAMPLES);
    }
    vec2 uv = uv_at(gl_FragCoord.xy);
    vec4 place = place_at(uv);
    if (place.z > 0.0) {
        float level = log2(place.z);
        vec2 leaf_px = u_tile / (place.z * u_atlas_per_px), inside = fract(uv * place.z / u_tile);
        vec2 edge_px = min(inside, 1.0 - inside) * leaf_px;
        float frame = 1.0 - smoothstep(0.4, 1.1, min(edge_px.x, edge_px.y));
        frame = mix(0.5, 0.9 * frame, smoothstep(3.0, 6.0, leaf_px.x));
        colour = mix(colour, shining(colour, level, place.w), u_leaves);
        colour = mix(colour, mix(vec3(0.95), level_colour(level), u_leaves), frame * mix(0.2, 1.0, u_leaves));
    }
    out_colour = vec4(colour, 1.0);
}
