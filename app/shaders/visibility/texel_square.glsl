// Where on a texel visibility is looked up, so that the mean is that over its area: of a light that is in one place, at 4×4 places; of
// a light that shoots from many, at one, for each of its shots another one, or where a part of it passes what is blended by chance,
// at more. Where one flat surface fills a texel; else, and of the sky, in the middle.
#include "common/facet.glsl"
#include "common/tile.glsl"
#include "common/leaves.glsl"

const float WHOLE = 1e-3;  // of a texel's square that may be missing: rounding
const int PLACES_EDGE = 4;
#define MANY_EDGE 1  // places along the edge of a texel, of a shot of a light that shoots from many
const int MIDDLE = -1;  // the shot of a light that is looked up there
const vec2 STEP = vec2(0.7548776662466927, 0.5698402909980532);  // of a sequence that fills a square evenly [Roberts18, R2]

// Whether one flat surface fills a texel, whose edges are u and v, solver space: it has the area of its square, and texels around it
// are of the same facet, or of none.
bool fills_square(usampler2D normal_ids, ivec2 px, Texel texel, out vec3 u, out vec3 v) {
    float size = texelFetch(t_leaves, px / TILE, 0).z;
    u = facet_entry(texel.facet, 0).xyz * size;
    v = facet_entry(texel.facet, 1).xyz * size;
    float square = length(cross(u, v));
    bool fills = abs(texel.area - square) <= WHOLE * square;
    ivec2 first = px / TILE * TILE;
    for (int k = 0; k < 4; ++k) {
        ivec2 step = k < 2 ? ivec2(2 * k - 1, 0) : ivec2(0, 2 * k - 5);
        uint facet = facet_from_ids(texelFetch(normal_ids, clamp(px + step, first, first + TILE - 1), 0).y);
        fills = fills && (facet == texel.facet || facet == 0u);
    }
    return fills;
}

// How far from its middle places on a texel lie at most, along each edge, over half of that: where the samples around them lie within
// it. Those beyond may look past a wall that stands on its border. sight: a unit vector from the light; sample: of its map, how wide
vec2 within_texel(vec3 u, vec3 v, vec3 sight, float sample_width) {
    vec3 a = u - dot(u, sight) * sight, b = v - dot(v, sight) * sight;
    return max(1.0 - 2.0 * sample_width * vec2(length(b), length(a)) / max(length(cross(a, b)), 1e-30), 0.0);
}

// How many places on a texel a shot looks at, and where the nth of them is, from -1/2 to 1/2 along the edges. shot: which of the
// shots of its light it is, from 1; 0: the only one
int places_edge(int shot) { return shot == 0 ? PLACES_EDGE : shot == MIDDLE ? 1 : MANY_EDGE; }
int places_of(int shot) { return places_edge(shot) * places_edge(shot); }

vec2 place_of(int shot, int nth) {
    int edge = places_edge(shot);
    vec2 even = vec2(nth % edge, nth / edge) / float(edge);
    if (shot == MIDDLE) return vec2(0.0);
    return (shot == 0 ? even + 0.5 / float(edge) : fract(even + float(shot) * STEP)) - 0.5;
}
