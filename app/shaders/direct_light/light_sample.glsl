// Where to look for a lamp without area: to its point or, where it has a radius or an angle, to a point of its sphere or its disc.
#include "common/hemisphere.glsl"
#include "common/item.glsl"
#include "common/light.glsl"

// Evenly within a cone of directions; ``height``: 1 - cosine of half its angle.
vec3 direction_in(vec3 axis, float height, vec2 share) {
    float z = 1.0 - share.x * height, r = sqrt(max(1.0 - z * z, 0.0)), phi = 2.0 * PI * share.y;
    return frame_of(axis) * vec3(r * cos(phi), r * sin(phi), z);
}

// From a place: the direction (unit), and how far anything hides it.
vec3 towards(Light light, vec3 from, vec2 share, out float far) {
    vec3 way = light.from_afar ? -light.direction : light.position - from;
    float r = length(way);
    far = light.from_afar ? 2.0 * FAR : r;
    way /= r;
    if (light.extent <= 0.0) return way;
    if (light.from_afar) return direction_in(way, light.extent, share);
    float sine2 = min(light.extent * light.extent / (r * r), 1.0);
    vec3 sampled = direction_in(way, 1.0 - sqrt(1.0 - sine2), share);
    float along = dot(sampled, way) * r;  // the near end of the sphere's chord
    far = max(along - sqrt(max(along * along - r * r + light.extent * light.extent, 0.0)), 0.0);
    return sampled;
}
