// Triangles that emit, of one set of lamps: four rows each. A lamp that shines to both sides does so with its whole exitance.
uniform sampler2D t_lamps;

struct Lamp {
    vec3 corner;
    float area;
    vec3 u, v;       // edges from the corner
    bool two_sided;
    vec3 exitance;   // relative to that of its set
};

Lamp load_lamp(int nth) {
    vec4 a = texelFetch(t_lamps, ivec2(0, nth), 0), b = texelFetch(t_lamps, ivec2(1, nth), 0);
    vec4 c = texelFetch(t_lamps, ivec2(2, nth), 0), d = texelFetch(t_lamps, ivec2(3, nth), 0);
    return Lamp(a.xyz, a.w, b.xyz, c.xyz, b.w > 0.5, d.rgb);
}

int lamp_count() { return textureSize(t_lamps, 0).y; }
