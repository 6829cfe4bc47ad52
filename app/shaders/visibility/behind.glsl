// Whether a receiver that a map's sample does not see is behind the plane of what that sample shows. At the foot of a wall the
// floor is nearer than the plane of the wall that goes on below it, but hides nothing of the wall, nor the wall of the floor.
#include "common/facet.glsl"
#include "common/item.glsl"

// position: of the receiver; sight: that the sample looks along; both in the solver space
bool behind(float item, vec3 position, vec3 sight) {
    if (item == OPEN || item == UNCHARTED) return true;
    vec4 plane = facet_entry(uint(item), 2);
    return (dot(plane.xyz, position) - plane.w) * sign(dot(plane.xyz, sight)) > COPLANAR;
}
