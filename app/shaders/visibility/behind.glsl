// What a sample of a map says of a receiver beside what it shows, at the foot of a wall, where floor and wall meet.
#include "common/facet.glsl"
#include "common/item.glsl"

const float ONE_PLANE = 1.0 - 1e-6;  // cosine between planes that are one: FLAT_ANGLE of app/atlas/sides.py
const float STEEP = 0.94;  // 20°: below it, what stands on a surface; above it, curved ones go on

// Whether a receiver is behind the plane of what a sample shows. At the foot of a wall the floor is nearer than the plane of the
// wall that goes on below it, but hides nothing of the wall, nor the wall of the floor.
// position: of the receiver; sight: that the sample looks along; both in the solver space
bool behind(float item, vec3 position, vec3 sight) {
    if (item == OPEN || item == UNCHARTED) return true;
    vec4 plane = facet_entry(uint(item), 2);
    return (dot(plane.xyz, position) - plane.w) * sign(dot(plane.xyz, sight)) > COPLANAR;
}

// Whether a sample sees a receiver, where it shows another facet just as deep as the receiver's own plane is there; ``tells``: whether
// it says anything of it. At the foot of a wall without thickness it may look past that, at the floor before it: what lies in the
// receiver's plane says nothing. Of the wall itself it sees what is not behind it. beyond: how much deeper what it shows is.
bool sees_beside(float item, float facet, float beyond, vec3 position, vec3 sight, out bool tells) {
    float cosine = abs(dot(facet_entry(uint(item), 2).xyz, facet_entry(uint(facet), 2).xyz));
    tells = cosine <= ONE_PLANE;
    return tells && (cosine > STEEP || beyond > 2.0 * COPLANAR || !behind(item, position, sight));
}
