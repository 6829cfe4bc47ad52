// What a node receives by one bounce of direct light, and from outside of the set.
#include "solvers/local/node.glsl"

uniform sampler2D t_first;
uniform sampler2D t_scale;
uniform sampler2D t_outside;

vec3 first_of(int slot, Node node) {
    vec3 first = texelFetch(t_scale, ivec2(0), 0).rgb * texelFetch(t_first, at_slot(slot), 0).rgb;
    return first + node.outside * texelFetch(t_outside, ivec2(0), 0).rgb;
}
