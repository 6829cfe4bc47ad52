// A candidate is a patch that may shoot: (power, x, LEVELS y + level, power of all candidates that it is the strongest of), with
// x, y its lower corner [texels]. A block that is part of a larger patch has a negative a instead, and its flux in rgb.
#include "solvers/shooting/block.glsl"

#define LEVELS  // of patches, at most
const vec2 UNLIT_YET = vec2(3e38, 0.0);  // least and greatest irradiance of no texel
const float COVERED = 0.05;  // a texel that has so little of the irradiance of its patch's brightest lies under something

float power_of(vec3 flux) { return dot(abs(flux), vec3(1.0)); }
vec4 candidate(float power, ivec2 corner_px, int level, float all) {
    return vec4(power, corner_px.x, corner_px.y * LEVELS + level, all);
}
ivec2 corner_of(vec4 candidate) { return ivec2(int(candidate.y), int(candidate.z) / LEVELS); }
int level_of(vec4 candidate) { return int(candidate.z) % LEVELS; }

vec4 part(vec3 flux, int largest, int finest) { return vec4(flux, -1 - largest - LEVELS * finest); }
bool is_part(vec4 block) { return block.a < 0.0; }
int largest_of(vec4 part) { return int(-1.0 - part.a) % LEVELS; }
int finest_of(vec4 part) { return int(-1.0 - part.a) / LEVELS; }

vec2 lit_with(vec2 lit, vec2 other) { return vec2(min(lit.x, other.x), max(lit.y, other.y)); }
// H: irradiance, below zero for a while where a lamp was dimmed
vec2 lit_with(vec2 lit, vec3 H) { return lit_with(lit, vec2(dot(max(H, 0.0), vec3(1.0)))); }
bool partly_covered(vec2 lit) { return lit.x < COVERED * lit.y; }
