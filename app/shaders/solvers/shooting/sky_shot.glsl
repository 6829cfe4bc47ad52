// A direction from which the sky is shot, and its map: all of the scene in parallel projection, x to the right, y up.
#define PIXELS  // along the edge of the map

uniform sampler2D t_shots;

struct SkyShot {
    mat3 axes;  // x and y of the map, and towards the sky
    vec3 irradiance;
};

SkyShot load_sky_shot(int nth) {
    vec3 rows[4];
    for (int row = 0; row < 4; ++row) rows[row] = texelFetch(t_shots, ivec2(row, nth), 0).xyz;
    return SkyShot(mat3(rows[0], rows[1], rows[2]), rows[3]);
}

const float MAP = float(PIXELS);
const float WIDTH = 1.0 - 4.0 / MAP;   // of the map, that the scene's sphere of radius 1 fills: samples beside each are there
const float DEPTH = 0.5 * (1.0 - 1.0 / 1024.0);  // of its range of depths, that the radius fills

vec2 px_of(vec3 local) { return (0.5 + 0.5 * WIDTH * local.xy) * MAP; }
float depth_of(float height) { return 0.5 - DEPTH * height; }
