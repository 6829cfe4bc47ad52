// Draws the hemisphere by its vertices: edges, which are circles in the map, become straight. Right within a texel where an edge
// is short enough, see app/visibility/occluders.py. [Wallner10, 5]
#include "common/item.glsl"
#include "visibility/projections/hemisphere.glsl"

in vec3 in_position;
in vec2 in_sides;   // of the triangle that this vertex ends: item of its front, of its back
in vec3 in_normal;  // of its plane

out gl_PerVertex {
    vec4 gl_Position;
    float gl_ClipDistance[1];
};
flat out vec2 v_sides;
flat out vec4 v_plane;  // n and n·x, seen from the shooter
flat out float v_own;

void draw(int view, vec3 origin, mat3 axes, float facet, int shot, int shots) {
    vec3 v = (in_position - origin) * axes;
    // p = v.xy / w: clipped at the horizon, an edge ends in the right direction, and what is behind the shooter has w >= 0
    float w = length(v) + v.z;
    vec2 maps = vec2(1.0, float(shots));
    vec2 centre_ndc = vec2(1.0, 1.0 + 2.0 * float(shot)) / maps - 1.0;
    gl_Position = vec4(centre_ndc * w + v.xy / maps, 0.0, w);
    gl_ClipDistance[0] = v.z - COPLANAR;
    vec3 normal = in_normal * axes;
    v_sides = in_sides;
    v_plane = vec4(normal, dot(normal, v));
    v_own = facet;
}
