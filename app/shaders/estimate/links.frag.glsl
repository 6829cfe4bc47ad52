// Where a ray of a node ends, and how light comes back from there.
#include "estimate/node.glsl"
#include "estimate/surface.glsl"

layout(location = 0) out vec4 out_hit;     // triangle of the scene, weights of its corners 1 and 2, 1 on its front; triangle -1: nothing
layout(location = 1) out vec4 out_albedo;  // a: irradiance, the mean of its colours [W/m²]

void main() {
    Node node = node_of(int(gl_FragCoord.y));
    Hit hit = closest_hit(node.origin, direction_of(node, int(gl_FragCoord.x)), 0.0, REACH);
    out_hit = vec4(-1.0, 0.0, 0.0, 0.0);
    out_albedo = vec4(0.0);
    if (hit.slot < 0) return;
    Surface seen = surface_of(hit);
    out_hit = vec4(float(triangle_of(hit)), hit.weights, hit.front);
    out_albedo = vec4(seen.albedo, dot(seen.irradiance, vec3(1.0 / 3.0)));
}
