// A direction from which light comes, and its map: all of the scene in parallel projection, x to the right, y up. The shooter's
// exitance is the irradiance on what faces it.
#include "solvers/shooting/shooter_block.glsl"
#define PIXELS  // along the edge of the map
#define MARGIN  // of these, beside the scene

// Columns: x and y of the map, and towards the light
mat3 axes_of(Shooter s) { return mat3(s.edge_u, s.edge_v, s.normal); }

const float MAP = float(PIXELS);
const float WIDTH = 1.0 - float(MARGIN) / MAP;  // of the map, that the scene's sphere of radius 1 fills: samples beside each are there
const float DEPTH = 0.5 * (1.0 - 1.0 / 1024.0);  // of its range of depths, that the radius fills

vec2 px_of(vec3 local) { return (0.5 + 0.5 * WIDTH * local.xy) * MAP; }
float depth_of(float height) { return 0.5 - DEPTH * height; }
