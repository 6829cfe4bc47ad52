// The scene as seen from a direction of the sky: an instance for each of the maps that lie above each other.
#include "solvers/shooting/sky_shot.glsl"

in vec3 in_position;
in vec2 in_sides;  // of the triangle that this vertex ends: item of its front, of its back

flat out vec2 v_sides;
flat out int v_map;
out vec3 v_place;

void main() {
    SkyShot s = load_sky_shot(gl_InstanceID);
    vec3 local = in_position * s.axes;
    vec2 px = px_of(local) + vec2(0.0, MAP * float(gl_InstanceID));
    vec2 size = vec2(MAP, MAP * float(textureSize(t_shots, 0).y));
    gl_Position = vec4(2.0 * px / size - 1.0, 2.0 * depth_of(local.z) - 1.0, 1.0);
    v_sides = in_sides;
    v_map = gl_InstanceID;
    v_place = in_position;
}
