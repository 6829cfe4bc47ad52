// The record of one shooter, made by choose.frag.glsl: a row of t_shooters. See app/solvers/shooting/shot.py.
struct Shooter {
    vec3 origin;     // where visibility is sampled from, solver space
    float area;      // A_i, solver space
    vec3 normal;
    uint facet;
    vec3 centre;     // of the polygon
    vec3 edge_u;     // the polygon is the parallelogram centre ± edge_u/2 ± edge_v/2, with area A_i
    vec3 edge_v;
    vec3 exitance;   // mean of what is shot, stored units
    ivec2 patch_px;  // lower corner of the patch in the tile pool [texels]
    int size_px;     // edge of the patch [texels]; 0: no shot
    bool even;       // whether all its texels shoot the mean, and keep what they have above or below it
    float chart;     // texels of others do not belong to the shooter
};

const int SHOOTER_ROWS = 6;

Shooter shooter_from_rows(vec4 rows[SHOOTER_ROWS]) {
    Shooter s;
    s.origin = rows[0].xyz;
    s.area = rows[0].w;
    s.normal = rows[1].xyz;
    s.facet = uint(rows[1].w);
    s.centre = rows[2].xyz;
    s.chart = rows[2].w;
    s.edge_u = rows[3].xyz;
    s.edge_v = rows[4].xyz;
    s.patch_px = ivec2(rows[3].w, rows[4].w);
    s.exitance = rows[5].xyz;
    s.size_px = abs(int(rows[5].w));
    s.even = rows[5].w > 0.0;
    return s;
}

vec4 shooter_row(Shooter s, int row) {
    if (row == 0) return vec4(s.origin, s.area);
    if (row == 1) return vec4(s.normal, float(s.facet));
    if (row == 2) return vec4(s.centre, s.chart);
    if (row == 3) return vec4(s.edge_u, float(s.patch_px.x));
    if (row == 4) return vec4(s.edge_v, float(s.patch_px.y));
    return vec4(s.exitance, float(s.even ? s.size_px : -s.size_px));
}

Shooter load_shooter(sampler2D shooters, int shot) {
    vec4 rows[SHOOTER_ROWS];
    for (int row = 0; row < SHOOTER_ROWS; ++row) rows[row] = texelFetch(shooters, ivec2(row, shot), 0);
    return shooter_from_rows(rows);
}

// Rows are the shooter's axes: +z its normal, +x along its first edge.
mat3 world_axes(Shooter s) {
    vec3 x = normalize(s.edge_u - s.normal * dot(s.edge_u, s.normal));
    return mat3(x, cross(s.normal, x), s.normal);
}
