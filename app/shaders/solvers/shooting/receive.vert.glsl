// One quad per receiver: a row of planar tiles, whose texels follow from its corner and edges, or a general tile, whose texels
// are read. Shots that its own plane or the shooter's hides entirely are left out;
// so are, in the near-field pass, those in whose far field it lies, and the other way round.
#define PLANAR 1
#define NEAR_FIELD 0
#include "common/item.glsl"
#include "common/atlas.glsl"
#include "solvers/shooting/shooter_block.glsl"
#include "solvers/shooting/far_field.glsl"

uniform vec2 u_size;  // of the tile pool [texels]
uniform int u_shots;  // from u_first on
#if PLANAR
uniform sampler2D t_materials;
#endif

in vec4 in_rect;  // corner and size in the tile pool [texels]
in vec4 in_a;     // PLANAR: position of the corner, facet     else: centre and radius of a bounding sphere
in vec4 in_b;     // PLANAR: ∂p/∂u per texel, material         else: mean normal, half thickness along it
in vec4 in_c;     // PLANAR: ∂p/∂v per texel, 0                else: 0

flat out uint v_shots;
#if PLANAR
out vec3 v_position;
flat out vec3 v_normal;
flat out float v_facet;
flat out vec3 v_albedo;
#if LIGHT
flat out vec3 v_u;  // edges of a texel
flat out vec3 v_v;
#endif
#endif

#if !LIGHT
float support(Shooter s, vec3 axis) { return 0.5 * (abs(dot(s.edge_u, axis)) + abs(dot(s.edge_v, axis))); }

#if PLANAR
bool hidden(Shooter s, vec3 normal, vec3 u, vec3 v) {
    vec3 middle = in_a.xyz + 0.5 * (u + v) - s.centre;
    float height = dot(middle, s.normal) + 0.5 * (abs(dot(u, s.normal)) + abs(dot(v, s.normal)));
    return height <= COPLANAR || support(s, normal) - dot(middle, normal) <= COPLANAR;
}

float squared_distance(Shooter s, vec3 u, vec3 v) {
    vec3 d = s.centre - in_a.xyz;  // u and v are orthogonal: charts of planar tiles are rectangles
    float a = clamp(dot(d, u) / dot(u, u), 0.0, 1.0), b = clamp(dot(d, v) / dot(v, v), 0.0, 1.0);
    vec3 nearest = d - a * u - b * v;
    return dot(nearest, nearest);
}
#else
bool hidden(Shooter s) {
    if (dot(in_a.xyz - s.centre, s.normal) + in_a.w <= COPLANAR) return true;
    return dot(s.centre - in_a.xyz, in_b.xyz) + support(s, in_b.xyz) + in_b.w <= COPLANAR;
}

float squared_distance(Shooter s) {
    float d = max(distance(s.centre, in_a.xyz) - in_a.w, 0.0);
    return d * d;
}
#endif

#endif

void main() {
    vec2 at = in_rect.zw * vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4((in_rect.xy + at) / u_size * 2.0 - 1.0, 0.0, 1.0);
#if PLANAR
    vec3 u = in_b.xyz * in_rect.z, v = in_c.xyz * in_rect.w;
    v_normal = normalize(cross(in_b.xyz, in_c.xyz));
    v_position = in_a.xyz + at.x * in_b.xyz + at.y * in_c.xyz;
    v_facet = in_a.w;
#if LIGHT
    v_u = in_b.xyz;
    v_v = in_c.xyz;
#endif
    v_albedo = texelFetch(t_materials, ivec2(0, int(in_b.w)), 0).rgb;
#endif
    v_shots = 0u;
    for (int shot = 0; shot < u_shots; ++shot) {
        Shooter s = shooter_of(shot);
#if LIGHT
        bool lit = true;
#elif PLANAR
        bool lit = !hidden(s, v_normal, u, v) && in_far_field(s, squared_distance(s, u, v)) != bool(NEAR_FIELD);
#else
        bool lit = !hidden(s) && in_far_field(s, squared_distance(s)) != bool(NEAR_FIELD);
#endif
        if (size_px(s) > 0 && lit) v_shots |= 1u << shot;
    }
    if (v_shots == 0u) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}
