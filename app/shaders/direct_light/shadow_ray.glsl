// A shadow ray: what it brings if nothing hides it, and what all that it might have gone to would bring.
struct ShadowRay {
    vec3 from, way;  // unit
    float far;       // how far anything hides it; 0: no ray
    vec3 brings, all;
};
