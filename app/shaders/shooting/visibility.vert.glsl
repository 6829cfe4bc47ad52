// The scene as the shooter sees it: every view of the projection in one draw, one instance each. [Coombe03, 3.2]
#include <projection>
#include "shooting/shooter_block.glsl"

in vec3 in_position;
in vec2 in_sides;  // of the triangle that this vertex ends: item of its front, of its back

flat out vec2 v_sides;

void main() {
    Shooter s = this_shooter();
    project(gl_InstanceID, (in_position - s.origin) * world_axes(s));
    v_sides = in_sides;
}
