// The parallelogram that stands for what the texels of a patch cover: of its area, centre and second moments. So strips of
// patches along a border, of which texels cover a part, tile it without gaps, and those that a slanted border cuts follow it.

// What texels cover, in texels of the leaf, from the patch's middle: area, centroid; of the texels' middles around it, times area,
// the sums of u² and v², and of u v; of their widths² along u and v, times area, the sums
struct Covered { float area; vec2 middle, squares; float product; vec2 widths; };

Covered nothing_covered() { return Covered(0.0, vec2(0.0), vec2(0.0), 0.0, vec2(0.0)); }

// at: the texel's middle, from the patch's; atlas: the same in the virtual atlas [texels of level 0]; size: of a texel there.
// Moments are kept around the centroid so far [West79]: of a thin strip, rounding would leave nothing of those around the middle.
void add_texel(inout Covered sum, Texel texel, vec2 at, vec2 atlas, float size) {
    vec3 u = facet_entry(texel.facet, 0).xyz, v = facet_entry(texel.facet, 1).xyz, n = cross(u, v);
    float square = dot(n, n), area = texel.area / (sqrt(square) * size * size), share = min(area, 1.0);
    vec3 p = texel.position - facet_entry(texel.facet, 3).xyz;
    vec2 place = vec2(dot(p, cross(v, n)), dot(p, cross(n, u))) / square;
    // a border cuts off one side: as far as the centroid is off the middle tells how wide it is covered
    vec2 off = clamp((place - atlas) / size, -0.5, 0.5), width = clamp(1.0 - 2.0 * abs(off), share, 1.0);
    vec2 before = at + off - sum.middle;
    sum.area += area;
    sum.middle += before * (area / sum.area);
    vec2 after = at + off - sum.middle;
    sum.squares += area * before * after;
    sum.product += area * before.x * after.y;
    sum.widths += area * width * width;
}

// Edges of the parallelogram, in texels: one along an axis, the other along what correlates with it
void covered_edges(Covered sum, out vec2 edge_u, out vec2 edge_v) {
    // 12 variance is a uniform strip's width²
    vec2 squares = (12.0 * sum.squares + sum.widths) / sum.area, least = sum.widths / sum.area;
    bool wide = squares.x >= squares.y;
    float along = sqrt(wide ? squares.x : squares.y), lean = 12.0 * sum.product / (sum.area * along);
    float across = sqrt(max((wide ? squares.y : squares.x) - lean * lean, wide ? least.y : least.x));
    edge_u = wide ? vec2(along, lean) : vec2(across, 0.0);
    edge_v = wide ? vec2(0.0, across) : vec2(lean, along);
}
