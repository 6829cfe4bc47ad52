// Σ_j F_ij over the lamps of a set, as if nothing stood between: Lambert's closed form [Lambert1760; Baum89], the mean over 2×2 places
// of the texel where that is near.
#include "solvers/gathering/lamp.glsl"
#include "solvers/gathering/origin.glsl"

layout(location = 0) out float out_unoccluded;

// (r / texel)² from where on the light changes so little in a texel that its middle tells: F ~ 1/r², so by (texel / r)² / 4
const float FAR_TEXELS = 100.0;

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

void main() {
    Origin o = load_origin(ivec2(gl_FragCoord.xy));
    out_unoccluded = 0.0;
    if (!o.there) return;
    float texel2 = max(dot(o.u, o.u), dot(o.v, o.v));
    for (int nth = 0; nth < lamp_count(); ++nth) {
        Lamp lamp = load_lamp(nth);
        vec3 facing = cross(lamp.u, lamp.v), middle = lamp.corner + (lamp.u + lamp.v) / 3.0 - o.position;
        float reach2 = max(dot(lamp.u, lamp.u), dot(lamp.v, lamp.v));
        int places = dot(middle, middle) > reach2 + FAR_TEXELS * texel2 ? 1 : 4;
        for (int k = 0; k < places; ++k) {
            vec3 a = lamp.corner - start_of(o, places == 4 ? vec2(k & 1, k >> 1) * 0.5 + 0.25 : vec2(0.5));
            float height = -dot(a, facing) / (2.0 * lamp.area);
            if (height <= COPLANAR && !(lamp.two_sided && height < -COPLANAR)) continue;
            // seen from its front its corners go clockwise about the normal of who looks
            float F = -form_factor(a, a + lamp.u, a + lamp.v, o.normal);
            out_unoccluded += max(height > 0.0 ? F : -F, 0.0) / float(places);
        }
    }
}
