// The visibility map as a picture: a stable colour per facet, darker with depth; black is the open, grey a side without texels.
#include "common/item.glsl"

uniform sampler2D t_items;
uniform sampler2D t_depth;

layout(location = 0) out vec4 out_colour;

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    float item = texelFetch(t_items, px, 0).r, depth = texelFetch(t_depth, px, 0).r;
    // hues at golden-ratio steps: neighbouring numbers look different
    vec3 hue = 0.55 + 0.35 * cos(6.2831853 * (fract(item * 0.61803399) + vec3(0.0, 0.33, 0.67)));
    vec3 colour = item == OPEN ? vec3(0.0) : item == UNCHARTED ? vec3(0.15) : hue;
    out_colour = vec4(colour * mix(1.0, 0.35, depth), 1.0);
}
