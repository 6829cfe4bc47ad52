// The scene as the shooter sees it: every view of the projection in one draw, one instance each. [Coombe03, 3.2]
#include <projection>
#include "shooting/shooter_block.glsl"

in vec3 in_position;
in uvec4 in_ids;

flat out uvec2 v_facets;

void main() {
    Shooter s = this_shooter();
    project(gl_InstanceID, (in_position - s.origin) * world_axes(s));
    v_facets = in_ids.xy;
    // the shooter's own polygon is edge-on: nothing of it may cover the rim
    if (in_ids.x == s.facet || in_ids.y == s.facet) gl_ClipDistance[0] = -1.0;
}
