// The scene as the shooters see it: every view of every map in one draw, one instance each. [Coombe03, 3.2]
#include <projection>
#include "shooting/shooter_block.glsl"
#define VIEWS 5

uniform int u_maps;  // maps that lie above each other in the target

in vec3 in_position;
in vec2 in_sides;  // of the triangle that this vertex ends: item of its front, of its back

flat out vec2 v_sides;
flat out float v_own;  // the shooter's facet

void main() {
    int shot = gl_InstanceID / VIEWS;
    Shooter s = shooter_of(shot);
    project(gl_InstanceID - shot * VIEWS, (in_position - s.origin) * world_axes(s), shot, u_maps);
    v_sides = in_sides;
    v_own = float(s.facet);
}
