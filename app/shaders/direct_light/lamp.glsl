// Triangles that emit, of one set of lamps: four texels each; where an image says what they emit, three more: the places in the
// virtual atlas of their corners, on the front and on the back. A lamp that shines to both sides does so with its whole exitance.
#include "direct_light/folded.glsl"
#define PICTURE 0
uniform sampler2D t_lamps;  // folded
uniform int u_lamps;        // how many

struct Lamp {
    vec3 corner;
    float area;
    vec3 u, v;       // edges from the corner
    bool two_sided;
    vec3 exitance;   // relative to that of its set
};

const int LAMP_TEXELS = PICTURE == 1 ? 7 : 4;

vec4 lamp_texel(int nth, int texel) { return texelFetch(t_lamps, folded(LAMP_TEXELS * nth + texel), 0); }

Lamp load_lamp(int nth) {
    vec4 a = lamp_texel(nth, 0), b = lamp_texel(nth, 1), c = lamp_texel(nth, 2), d = lamp_texel(nth, 3);
    return Lamp(a.xyz, a.w, b.xyz, c.xyz, b.w > 0.5, d.rgb);
}

// What is seen under a smaller solid angle [sr] is alike all over: a point is chosen evenly on its area. Rounding of angles,
// 1e-6, is less than a ten-thousandth of any larger one.
const float SMALL = 0.02;
const float INSIDE = 1e-6;  // of a lamp's edge, that a point on it keeps from its rim

// A point on a lamp, and ``area``: one over the density of such points there. Evenly within the solid angle under which the lamp
// is seen [Arvo95], or it is missed where it is near.
vec3 point_on(Lamp lamp, vec3 normal, vec3 from, vec2 share, out float area) {
    float root = sqrt(share.x);
    vec3 to = lamp.corner + (1.0 - root) * lamp.u + share.y * root * lamp.v;
    area = lamp.area;
    vec3 a = normalize(lamp.corner - from), b = normalize(lamp.corner + lamp.u - from), c = normalize(lamp.corner + lamp.v - from);
    float solid = 2.0 * atan(abs(dot(a, cross(b, c))), 1.0 + dot(a, b) + dot(b, c) + dot(c, a));  // [Oosterom83]
    if (solid < SMALL) return to;
    vec3 ab = normalize(cross(a, b)), ca = normalize(cross(c, a));
    float cos_a = clamp(-dot(ab, ca), -1.0, 1.0), sin_a = sqrt(1.0 - cos_a * cos_a), part = share.x * solid;
    // the smaller triangle a, b, c' of that part of the solid angle
    float phi = part - acos(cos_a), s = sin(phi), t = cos(phi);
    float u = t - cos_a, v = s + sin_a * dot(a, b);
    float q = clamp(((v * t - u * s) * cos_a - v) / max((v * s + u * t) * sin_a, 1e-30), -1.0, 1.0);
    vec3 along = q * a + sqrt(1.0 - q * q) * normalize(c - dot(c, a) * a);
    float z = 1.0 - share.y * (1.0 - dot(along, b));
    vec3 direction = z * b + sqrt(max(1.0 - z * z, 0.0)) * normalize(along - dot(along, b) * b);
    float cosine = dot(direction, normal), height = dot(lamp.corner - from, normal);
    if (abs(cosine) < 1e-6) return to;
    float r = height / cosine;
    area = solid * r * r / abs(cosine);
    // seen at a grazing angle, rounding might put it beyond an edge, and there behind the next wall
    vec3 at = from + r * direction - lamp.corner;
    vec2 along_uv = vec2(dot(cross(at, lamp.v), normal), dot(cross(lamp.u, at), normal)) / (2.0 * lamp.area);
    along_uv = max(along_uv, vec2(INSIDE));
    along_uv *= min((1.0 - INSIDE) / (along_uv.x + along_uv.y), 1.0);
    return lamp.corner + along_uv.x * lamp.u + along_uv.y * lamp.v;
}
