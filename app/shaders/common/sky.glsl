// The map of the sky, equirectangular: see app/scene/sky.py.
uniform sampler2D t_sky;

const float TURN = 6.28318530717958647692;

// The place of a direction in the map: from azimuth 0, -z, over +x; from the zenith down.
vec2 sky_uv(vec3 direction) {
    return vec2(fract(atan(direction.x, -direction.z) / TURN), acos(clamp(direction.y, -1.0, 1.0)) * 2.0 / TURN);
}
