// Σ_j F_ij over the lamps of a set, as if nothing stood between: Lambert's closed form [Lambert1760; Baum89], the mean over places
// of the texel: one from afar, 2×2, and more of them where a lamp is nearer than the texel is wide.
#include "direct_light/lamp.glsl"
#include "visibility/origin.glsl"

layout(location = 0) out float out_unoccluded;

const float AFAR = 10.0;  // texels, from where on the light in one is even: F ~ 1/r² bends by (texel / r)² / 4

float edge(vec3 a, vec3 b, vec3 normal) {
    vec3 axis = cross(a, b);
    float sine = max(length(axis), 1e-30);  // atan(0, 0) is undefined
    return atan(sine, dot(a, b)) * dot(axis, normal) / sine;
}

// Of a triangle, corners relative to the point; what lies below the horizon is cut off.
float form_factor(vec3 a, vec3 b, vec3 c, vec3 normal) {
    vec3 h = vec3(dot(a, normal), dot(b, normal), dot(c, normal));
    vec3 dive = vec3(0.0), rise = vec3(0.0);
    float sum = 0.0;
    for (int i = 0; i < 3; ++i) {
        vec3 here = a, next = b;
        if (h.x > 0.0 || h.y > 0.0) {
            vec3 cut = mix(here, next, clamp(h.x / (h.x - h.y), 0.0, 1.0));
            if (h.x <= 0.0) { here = cut; rise = cut; }
            if (h.y <= 0.0) { next = cut; dive = cut; }
            sum += edge(here, next, normal);
        }
        vec3 first = a;
        a = b; b = c; c = first;
        h = h.yzx;
    }
    return (sum + edge(dive, rise, normal)) / (2.0 * PI);
}

const float SPACING = 0.25;  // of places, over the distance of the lamp: what F bends by between them is a hundredth of it
const int MOST = 16;         // places along an edge

// How far a lamp is at least.
float distance_of(Lamp lamp, vec3 p) {
    vec3 corners[3] = vec3[](lamp.corner - p, lamp.corner + lamp.u - p, lamp.corner + lamp.v - p);
    vec3 normal = cross(lamp.u, lamp.v);
    float least = 1e30;
    bool inside = true;
    for (int i = 0; i < 3; ++i) {
        vec3 a = corners[i], along = corners[(i + 1) % 3] - a;
        vec3 near = a + along * clamp(-dot(a, along) / dot(along, along), 0.0, 1.0);
        least = min(least, dot(near, near));
        inside = inside && dot(cross(along, -a), normal) >= 0.0;
    }
    return inside ? abs(dot(corners[0], normal)) / length(normal) : sqrt(least);
}

void main() {
    Origin o = load_origin(ivec2(gl_FragCoord.xy));
    out_unoccluded = 0.0;
    if (!o.there) return;
    float width = max(length(o.u), length(o.v));
    for (int nth = 0; nth < u_lamps; ++nth) {
        Lamp lamp = load_lamp(nth);
        vec3 facing = cross(lamp.u, lamp.v), way = lamp.corner - o.position;
        // wholly behind the lamp, or the lamp wholly below the horizon: no place of the texel sees it
        if (!lamp.two_sided && dot(way, facing) > width * length(facing)) continue;
        float rise = dot(way, o.normal) + max(max(dot(lamp.u, o.normal), dot(lamp.v, o.normal)), 0.0);
        if (rise < -COPLANAR) continue;
        float distance = distance_of(lamp, o.position);
        int edge = o.square ? int(clamp(ceil(width / (SPACING * distance)), distance > AFAR * width ? 1.0 : 2.0, float(MOST))) : 1;
        for (int k = 0; k < edge * edge; ++k) {
            vec3 a = lamp.corner - start_of(o, (vec2(k % edge, k / edge) + 0.5) / float(edge));
            float height = -dot(a, facing) / (2.0 * lamp.area);
            if (height <= COPLANAR && !(lamp.two_sided && height < -COPLANAR)) continue;
            // seen from its front its corners go clockwise about the normal of who looks
            float F = -form_factor(a, a + lamp.u, a + lamp.v, o.normal);
            out_unoccluded += max(height > 0.0 ? F : -F, 0.0) / float(edge * edge);
        }
    }
}
