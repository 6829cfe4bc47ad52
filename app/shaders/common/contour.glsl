// Form factors of polygons, without visibility: Lambert's contour sum. [Lambert1760; Baum89]
const float TWO_PI = 6.28318530717958647692;

// Lambert's contour sum, one edge: the angle under which it is seen, times the height of its normal. [Lambert1760; Baum89]
float contour_edge(vec3 a, vec3 b, vec3 normal) {
    vec3 axis = cross(a, b);
    float sine = max(length(axis), 1e-30);  // atan(0, 0) is undefined
    return atan(sine, dot(a, b)) * dot(axis, normal) / sine;
}

// The parallelogram seen from the receiver, corners a b c d clockwise, heights h above its horizon; what lies below is cut off.
// Every edge is cut by itself; the cut itself is one more edge, from where the contour dives (out) to where it rises (in).
float contour(vec3 a, vec3 b, vec3 c, vec3 d, vec3 normal) {
    vec4 h = vec4(dot(a, normal), dot(b, normal), dot(c, normal), dot(d, normal));
    vec3 dive = vec3(0.0), rise = vec3(0.0);
    float sum = 0.0;
    for (int i = 0; i < 4; ++i) {
        vec3 here = a;
        vec3 next = b;
        float h_here = h.x, h_next = h.y;
        if (h_here > 0.0 || h_next > 0.0) {
            vec3 cut = mix(here, next, clamp(h_here / (h_here - h_next), 0.0, 1.0));
            if (h_here <= 0.0) { here = cut; rise = cut; }
            if (h_next <= 0.0) { next = cut; dive = cut; }
            sum += contour_edge(here, next, normal);
        }
        // the next edge
        vec3 first = a;
        a = b; b = c; c = d; d = first;
        h = h.yzwx;
    }
    return sum + contour_edge(dive, rise, normal);
}
