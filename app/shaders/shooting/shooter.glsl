// The record of one shooter, made by choose.frag.glsl: a column of t_shooters. See app/solvers/shooting/uniform.py.
struct Shooter {
    vec3 origin;     // where visibility is sampled from, solver frame
    float area;      // A_i, solver frame
    vec3 normal;
    uint facet;
    vec3 centre;     // of the polygon
    float power;     // Σ r·A over its texels, sum of RGB
    vec3 edge_u;     // the polygon is the parallelogram centre ± edge_u/2 ± edge_v/2, with area A_i
    vec3 edge_v;
    vec3 exitance;   // mean residual r_i, stored units
    ivec2 patch_px;  // lower corner of the patch in the node set [texels]
    int size_px;     // edge of the patch [texels]; 0: no shot
    vec3 lead;       // position of its strongest texel
    float reach;     // texels further from it do not belong to the shooter
};

const int SHOOTER_ROWS = 7;

Shooter load_shooter(sampler2D shooters, int shot) {
    vec4 r0 = texelFetch(shooters, ivec2(shot, 0), 0), r1 = texelFetch(shooters, ivec2(shot, 1), 0);
    vec4 r2 = texelFetch(shooters, ivec2(shot, 2), 0), r3 = texelFetch(shooters, ivec2(shot, 3), 0);
    vec4 r4 = texelFetch(shooters, ivec2(shot, 4), 0), r5 = texelFetch(shooters, ivec2(shot, 5), 0);
    vec4 r6 = texelFetch(shooters, ivec2(shot, 6), 0);
    ivec2 patch_px = ivec2(r3.w, r4.w);
    return Shooter(r0.xyz, r0.w, r1.xyz, uint(r1.w), r2.xyz, r2.w, r3.xyz, r4.xyz, r5.xyz, patch_px, int(r5.w), r6.xyz, r6.w);
}

vec4 shooter_row(Shooter s, int row) {
    if (row == 0) return vec4(s.origin, s.area);
    if (row == 1) return vec4(s.normal, float(s.facet));
    if (row == 2) return vec4(s.centre, s.power);
    if (row == 3) return vec4(s.edge_u, float(s.patch_px.x));
    if (row == 4) return vec4(s.edge_v, float(s.patch_px.y));
    if (row == 5) return vec4(s.exitance, float(s.size_px));
    return vec4(s.lead, s.reach);
}

// Rows are the shooter's axes: +z its normal, +x along its first edge.
mat3 world_axes(Shooter s) {
    vec3 x = normalize(s.edge_u - s.normal * dot(s.edge_u, s.normal));
    return mat3(x, cross(s.normal, x), s.normal);
}
