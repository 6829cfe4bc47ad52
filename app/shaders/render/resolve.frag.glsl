// The layer on every display texel, developed for the screen: done here, there are far fewer texels than pixels.
#include "common/colour.glsl"
#include "render/display.glsl"
uniform usampler2D t_source;
uniform float u_gain;  // exposure

layout(location = 0) out vec4 out_colour;

// layer_colour(texel_px): linear Rec.709 of a tile-pool texel
#include <layer>
// develop(rgb): linear Rec.709 of the screen, 0 to 1
#include <curve>
#include "render/shown.glsl"

void main() {
    uint source = texelFetch(t_source, ivec2(gl_FragCoord.xy), 0).x;
    ivec2 texel_px = ivec2(source & 0xFFFFu, source >> 16);
    vec3 colour = source == NO_SOURCE ? vec3(0.0) : layer_colour(texel_px);
    out_colour = vec4(shown(colour * u_gain), float(source != NO_SOURCE));
}
