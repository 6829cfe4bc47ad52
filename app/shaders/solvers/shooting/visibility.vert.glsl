// The scene as the shooters see it: every view of every map in one draw, one instance each. [Coombe03, 3.2]
#include <vertex>
#include "solvers/shooting/shooter_block.glsl"
#define VIEWS 5

uniform int u_maps;  // maps that lie above each other in the target

void main() {
    int shot = gl_InstanceID / VIEWS;
    Shooter s = shooter_of(shot);
    draw(gl_InstanceID - shot * VIEWS, s.origin, world_axes(s), float(s.facet), shot, u_maps);
}
