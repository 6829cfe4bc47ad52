// The visibility map as a picture: a stable colour per facet, darker with depth; black is the open, grey a side without texels.
#include "common/item.glsl"

uniform sampler2D t_map;

layout(location = 0) out vec4 out_colour;

void main() {
    vec2 shown = texelFetch(t_map, ivec2(gl_FragCoord.xy), 0).rg;
    // hues at golden-ratio steps: neighbouring numbers look different
    vec3 hue = 0.55 + 0.35 * cos(6.2831853 * (fract(shown.r * 0.61803399) + vec3(0.0, 0.33, 0.67)));
    vec3 colour = shown.r == OPEN ? vec3(0.0) : shown.r == UNCHARTED ? vec3(0.15) : hue;
    out_colour = vec4(colour * mix(1.0, 0.35, shown.g / FAR), 1.0);
}
