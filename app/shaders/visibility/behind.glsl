// Whether a receiver that a map's sample does not see is behind the plane of what that sample shows. At the foot of a wall the
// floor is nearer than the plane of the wall that goes on below it, but hides nothing of the wall, nor the wall of the floor.
#include "common/facet.glsl"

// to_shown: from the receiver to what is shown; sight: that the sample looks along; both in axes of the solver space
bool behind(float item, vec3 to_shown, vec3 sight, mat3 axes) {
    if (item == OPEN || item == UNCHARTED) return true;
    vec3 normal = cross(facet_entry(uint(item), 0).xyz, facet_entry(uint(item), 1).xyz) * axes;
    return dot(normal, to_shown) * dot(normal, sight) < 0.0;
}
