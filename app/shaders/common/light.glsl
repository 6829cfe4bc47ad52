// Lamps without area, four texels each, and what they give where nothing hides them; see app/scene/lights.py.
uniform sampler2D t_lights;

struct Light {
    vec3 position;     // solver space
    bool from_afar;    // it has a direction and no position
    vec3 direction;    // in which it shines
    float extent;      // radius of its sphere, or 1 - cosine of half the angle across of its disc
    vec3 intensity;    // in units of solver space; from afar what faces it receives
    float inverse_range;
    vec2 slope;        // of a spot's falloff between its cones
};

Light load_light(int nth) {
    vec4 a = texelFetch(t_lights, ivec2(0, nth), 0), b = texelFetch(t_lights, ivec2(1, nth), 0);
    vec4 c = texelFetch(t_lights, ivec2(2, nth), 0), d = texelFetch(t_lights, ivec2(3, nth), 0);
    return Light(a.xyz, a.w > 0.5, b.xyz, b.w, c.rgb, c.w, d.xy);
}

// Of what a light sends out, towards it being a unit vector: the share within a spot's cones, and what its range leaves of it.
float within_cone(Light light, vec3 towards) {
    float cone = clamp(light.slope.y - light.slope.x * dot(towards, light.direction), 0.0, 1.0);
    return cone * cone;
}

float within_range(Light light, float squared_distance) {
    float part = squared_distance * light.inverse_range * light.inverse_range;
    return max(1.0 - part * part, 0.0);
}

// What a point with this normal receives of it.
vec3 unoccluded(Light light, vec3 position, vec3 normal) {
    vec3 way = light.from_afar ? -light.direction : light.position - position;
    float r2 = max(dot(way, way), 1e-12), inverse = inversesqrt(r2), cosine = max(dot(way, normal) * inverse, 0.0);
    if (light.from_afar) return cosine * light.intensity;
    return cosine * within_cone(light, way * inverse) * within_range(light, r2) / r2 * light.intensity;
}
