// Which points around each one a window may reach: those of the same chart that face the same way, to which no wall stands in the way.
// Bit i + 4 of row j + 4 says it of the point (i, j) texels away; three rows in each number, nine bits each.
#include "common/atlas.glsl"
#include "common/texel_at.glsl"

uniform usampler2D t_origin_normal;  // and the chart
uniform sampler2D t_walls;            // see walls.frag.glsl

layout(location = 0) out uvec4 out_reach;

const int RADIUS = 4;
const uint NO_CHART = 0xFFFFFFFFu;
const float COS_ALIKE = 0.94;  // 20°

struct Window {
    uint chart;
    vec3 normal;
    ivec2 px, inside;
    vec2 uv;
    float texel;
};

Window window_at(ivec2 px) {
    uvec2 mine = texelFetch(t_origin_normal, px, 0).xy;
    vec3 leaf = texelFetch(t_leaves, px / TILE, 0).xyz;
    ivec2 inside = px % TILE;
    vec2 uv = (leaf.xy * float(TILE) + vec2(inside) + 0.5) * leaf.z;
    return Window(mine.y, normal_from_octahedral(mine.x), px, inside, uv, leaf.z);
}

// The point so many texels away; negative where there is none, or none alike.
ivec2 beside(Window w, ivec2 step) {
    ivec2 at = w.inside + step, there = w.px + step;
    if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, ivec2(TILE)))) there = texel_px_at(w.uv + vec2(step) * w.texel);
    if (there.y < 0) return ivec2(-1);
    uvec2 other = texelFetch(t_origin_normal, there, 0).xy;
    return other.y == w.chart && dot(normal_from_octahedral(other.x), w.normal) >= COS_ALIKE ? there : ivec2(-1);
}

// Whether a wall stands between a point and the one a step (along one axis) from it.
bool walled(ivec2 px, ivec2 next_px, ivec2 step) {
    vec2 walls = texelFetch(t_walls, step.x + step.y > 0 ? px : next_px, 0).rg;
    return (step.x != 0 ? walls.r : walls.g) > 0.5;
}

uvec3 reached = uvec3(0u);

void mark(int i, int j) {
    int row = j + RADIUS, third = row / 3;
    uint bit = 1u << (9 * (row - 3 * third) + i + RADIUS);
    reached |= uvec3(third == 0, third == 1, third == 2) * bit;
}

// Mark every point to which a way along v and then along u leads.
void main() {
    Window w = window_at(ivec2(gl_FragCoord.xy));
    out_reach = uvec4(0u);
    if (w.chart == NO_CHART || w.texel <= 0.0) return;  // nothing here, or no slot
    for (int up = -1; up <= 1; up += 2) {
        ivec2 row_px = w.px;
        for (int j = up < 0 ? -1 : 0; abs(j) <= RADIUS; j += up) {
            if (j != 0) {
                ivec2 next = beside(w, ivec2(0, j));
                if (next.y < 0 || walled(row_px, next, ivec2(0, up))) break;
                row_px = next;
            }
            mark(0, j);
            for (int along = -1; along <= 1; along += 2) {
                ivec2 px = row_px;
                for (int i = along; abs(i) <= RADIUS; i += along) {
                    ivec2 next = beside(w, ivec2(i, j));
                    if (next.y < 0 || walled(px, next, ivec2(along, 0))) break;
                    mark(i, j);
                    px = next;
                }
            }
        }
    }
    out_reach = uvec4(reached, 0u);
}
