// The parallelogram that stands for what the texels of a patch cover: of its area, centre and second moments. So strips of
// patches along a border, of which texels cover a part, tile it without gaps, and those that a slanted border cuts follow it.
const float SQRT_12 = 3.4641016151377544;  // over the standard deviation of a uniform strip: its width

// Sums over texels, in texels of the leaf, around the patch's middle: area, moments by u and v, u² and v², u v
struct Covered { float area; vec2 first, squares; float product; };

Covered nothing_covered() { return Covered(0.0, vec2(0.0), vec2(0.0), 0.0); }

// at: the texel's middle, from the patch's; atlas: the same in the virtual atlas [texels of level 0]; size: of a texel there
void add_texel(inout Covered sum, Texel texel, vec2 at, vec2 atlas, float size) {
    vec3 u = facet_entry(texel.facet, 0).xyz, v = facet_entry(texel.facet, 1).xyz, n = cross(u, v);
    float square = dot(n, n), area = texel.area / (sqrt(square) * size * size), share = min(area, 1.0);
    vec3 p = texel.position - facet_entry(texel.facet, 3).xyz;
    vec2 place = vec2(dot(p, cross(v, n)), dot(p, cross(n, u))) / square;
    // a border cuts off one side: as far as the centroid is off the middle tells how wide it is covered
    vec2 off = clamp((place - atlas) / size, -0.5, 0.5), width = clamp(1.0 - 2.0 * abs(off), share, 1.0);
    at += off;
    sum.area += area;
    sum.first += area * at;
    sum.squares += area * (at * at + width * width / 12.0);
    sum.product += area * at.x * at.y;
}

// Edges of the parallelogram, in texels: one along an axis, the other along what correlates with it
void covered_edges(Covered sum, out vec2 edge_u, out vec2 edge_v) {
    vec2 middle = sum.first / sum.area, variance = max(sum.squares / sum.area - middle * middle, 0.0);
    float both = sum.product / sum.area - middle.x * middle.y;
    bool wide = variance.x >= variance.y;
    float along = SQRT_12 * sqrt(wide ? variance.x : variance.y), lean = 12.0 * both / along;
    float across = sqrt(max(12.0 * (wide ? variance.y : variance.x) - lean * lean, 0.0));
    edge_u = wide ? vec2(along, lean) : vec2(across, 0.0);
    edge_v = wide ? vec2(0.0, across) : vec2(lean, along);
}
