// The scene as seen from the directions of some shots: an instance for each of the maps that lie above each other.
#include "solvers/shooting/direction_shot.glsl"

uniform int u_maps;  // that the target has room for

in vec3 in_position;
in vec2 in_sides;  // of the triangle that this vertex ends: item of its front, of its back

flat out vec2 v_sides;
flat out int v_map;
out vec3 v_place;

void main() {
    vec3 local = in_position * axes_of(shooter_of(gl_InstanceID));
    vec2 px = px_of(local) + vec2(0.0, MAP * float(gl_InstanceID));
    gl_Position = vec4(2.0 * px / vec2(MAP, MAP * float(u_maps)) - 1.0, 2.0 * depth_of(local.z) - 1.0, 1.0);
    v_sides = in_sides;
    v_map = gl_InstanceID;
    v_place = in_position;
}
