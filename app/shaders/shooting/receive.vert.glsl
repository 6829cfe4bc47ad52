// One quad per tile. A tile that the shooter's plane or its own plane hides entirely is not drawn.
#include "common/tiles.glsl"
#include "shooting/shooter.glsl"

uniform sampler2D t_shooters;
uniform sampler2D t_tile_bounds;
uniform int u_shot;
uniform int u_columns;  // tiles in a row of the node set
uniform vec2 u_size;    // of the node set [texels]

flat out Shooter v_shooter;

bool hidden(Shooter s, vec4 sphere, vec4 plane) {
    if (s.size_px == 0 || dot(sphere.xyz - s.centre, s.normal) < -sphere.w) return true;
    float reach = 0.5 * (abs(dot(s.edge_u, plane.xyz)) + abs(dot(s.edge_v, plane.xyz)));
    return dot(s.centre - sphere.xyz, plane.xyz) + reach < -plane.w;
}

void main() {
    ivec2 tile = ivec2(gl_InstanceID % u_columns, gl_InstanceID / u_columns);
    v_shooter = load_shooter(t_shooters, u_shot);
    vec4 sphere = texelFetch(t_tile_bounds, tile * ivec2(2, 1), 0);
    vec4 plane = texelFetch(t_tile_bounds, tile * ivec2(2, 1) + ivec2(1, 0), 0);
    gl_Position = tile_corner(tile, u_size);
    if (hidden(v_shooter, sphere, plane)) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}
