// The shooters of a batch: row k describes the k-th strongest of the bins' strongest patches. [Coombe03, 3.4]
//
// The polygon is the patch's own parallelogram, so that neighbouring patches tile their surface exactly. Visibility is
// sampled from the middle of what is shot; where part of the patch is dark (something stands on it), or the patch is not flat,
// from its leading texel.
#include "common/atlas.glsl"
#include "common/tile.glsl"
#include "common/albedo.glsl"
#include "solvers/shooting/patch_level.glsl"
#include "solvers/shooting/candidate.glsl"
#include "solvers/shooting/overshoot.glsl"
#include "solvers/shooting/emitter_group.glsl"
#include "solvers/shooting/shooter.glsl"
#include "solvers/shooting/belongs.glsl"
#include "solvers/shooting/covered.glsl"

const float WEAKEST = 0.1;       // a shot under a tenth of the batch's best waits for a later batch
const float MOST_REPRESENTED = 8.0;    // times its own area, a patch may represent
const float CANCELS = 1.0 / 256;  // under this share of Σ |R| A, Σ R A is what rounding leaves: texels give no mean for it

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_irradiance;
uniform sampler2D t_residual;
uniform sampler2D t_bins;
uniform float u_least;  // power that is worth a shot

layout(location = 0) out vec4 out_row;

// The candidate of the rank-th strongest bin; equal powers rank by index.
vec4 ranked_bin(int rank) {
    int bins = textureSize(t_bins, 0).x;
    vec4 last = vec4(3e38);
    int last_index = -1;
    for (int k = 0; k <= rank; ++k) {
        vec4 best = vec4(0.0);
        int best_index = -1;
        for (int i = 0; i < bins; ++i) {
            vec4 bin = texelFetch(t_bins, ivec2(i, 0), 0);
            bool follows = bin.x < last.x || (bin.x == last.x && i > last_index);
            if (follows && bin.x > best.x) { best = bin; best_index = i; }
        }
        last = best;
        last_index = best_index;
    }
    return last;
}

Texel texel_at(ivec2 px) { return load_texel(t_position_area, t_normal_ids, px); }

vec3 irradiance_at(ivec2 px) { return texelFetch(t_irradiance, px, 0).rgb; }

vec3 shoots(ivec2 px, Texel texel) {
    vec3 H = irradiance_at(px);
    return texelFetch(t_residual, px, 0).rgb + overshoot(H, albedo_of(t_materials, texel.material, px));
}

// The strongest texel near the middle of what the patch shoots: its plane is the shooter's. On a convex surface no other part of
// the patch then lies above that plane.
ivec2 leading_texel(ivec2 corner_px, int size, out Texel lead) {
    vec3 middle = vec3(0.0);
    float power = 0.0, strongest = 0.0;
    for (int i = 0; i < size * size; ++i) {
        ivec2 px = corner_px + ivec2(i % size, i / size);
        Texel texel = texel_at(px);
        float own = texel.area > 0.0 ? power_of(shoots(px, texel)) * texel.area : 0.0;
        middle += own * texel.position;
        power += own;
        strongest = max(strongest, own);
    }
    middle /= max(power, 1e-30);
    ivec2 lead_px = corner_px;
    lead.area = 0.0;
    float nearest = 3e38;
    for (int i = 0; i < size * size; ++i) {
        ivec2 px = corner_px + ivec2(i % size, i / size);
        Texel texel = texel_at(px);
        vec3 offset = texel.position - middle;
        if (texel.area <= 0.0) continue;
        float own = power_of(shoots(px, texel));
        if (own * texel.area > 0.5 * strongest && dot(offset, offset) < nearest) {
            nearest = dot(offset, offset);
            lead = texel;
            lead_px = px;
        }
    }
    return lead_px;
}

Shooter no_shooter() {
    Shooter s;
    s.signed_size = 0;
    return s;
}

Shooter shooter_from_patch(ivec2 corner_px, int size) {
    Texel lead;
    leading_texel(corner_px, size, lead);
    Shooter s = no_shooter();
    if (lead.area <= 0.0) return s;
    vec3 dpdu = facet_entry(lead.facet, 0).xyz, dpdv = facet_entry(lead.facet, 1).xyz;
    vec3 leaf = texelFetch(t_leaves, corner_px / TILE, 0).xyz;
    dpdu *= leaf.z;
    dpdv *= leaf.z;
    s.chart = chart_of(lead.facet);
    // the facet's own normal: the texels' packed ones tilt by 2^-15, enough to see what lies in the same plane
    s.normal = normalize(cross(dpdu, dpdv));
    if (dot(s.normal, lead.normal) < 0.0) s.normal = -s.normal;

    vec3 area_centre = vec3(0.0), power_centre = vec3(0.0), flux = vec3(0.0);
    float area = 0.0, power = 0.0;
    bool planar = true, alone = true;
    vec2 lit = UNLIT_YET;
    Covered covered = nothing_covered();
    for (int i = 0; i < size * size; ++i) {
        ivec2 at = ivec2(i % size, i / size), px = corner_px + at;
        Texel texel = texel_at(px);
        if (!belongs(texel, s.normal, s.chart)) {
            alone = alone && texel.area <= 0.0;
            continue;
        }
        vec3 r = shoots(px, texel);
        area += texel.area;
        flux += r * texel.area;
        area_centre += texel.position * texel.area;
        float own = power_of(r);
        power_centre += texel.position * texel.area * own;
        power += texel.area * own;
        planar = planar && texel.facet == lead.facet;
        lit = lit_with(lit, irradiance_at(px));
        vec2 middle = vec2(px % TILE) + 0.5;
        add_texel(covered, texel, vec2(at) - 0.5 * float(size - 1), (leaf.xy * float(TILE) + middle) * leaf.z, leaf.z);
    }
    s.area = area;
    s.exitance = flux / area;
    s.facet = lead.facet;
    s.patch_x = corner_px.x;
    s.patch_y = corner_px.y;
    bool whole = planar && !partly_covered(lit), even = whole && alone && power_of(flux) > CANCELS * power;
    s.signed_size = even ? size : -size;

    // see from the middle of what is shot, or where that may lie inside or under something, from the texel that leads
    s.origin = whole ? power_centre / power : lead.position;
    s.centre = area_centre / area;
    s.centre -= s.normal * dot(s.centre - s.origin, s.normal);

    // what is covered as a parallelogram in the shooter's plane, scaled to its area
    vec2 along, across;
    covered_edges(covered, along, across);
    vec3 edge_u = dpdu * along.x + dpdv * along.y, edge_v = dpdu * across.x + dpdv * across.y;
    if (dot(cross(edge_u, edge_v), s.normal) < 0.0) edge_v = -edge_v;
    float scale = sqrt(area / length(cross(edge_u, edge_v)));
    s.edge_u = edge_u * scale;
    s.edge_v = edge_v * scale;
    return s;
}

// Whether one patch of a group can represent all of them: like for like, and no small rest at an edge for much more; their flux
bool can_represent(ivec2 corner_px, int size, Shooter part, out vec3 flux) {
    bool all = true;
    float area = 0.0;
    vec2 lit = UNLIT_YET;
    flux = vec3(0.0);
    for (int i = 0; i < size * size; ++i) {
        ivec2 px = corner_px + ivec2(i % size, i / size);
        Texel texel = texel_at(px);
        all = all && (texel.area <= 0.0 || belongs(texel, part.normal, part.chart));
        if (texel.area <= 0.0) continue;
        area += texel.area;
        lit = lit_with(lit, irradiance_at(px));
        flux += shoots(px, texel) * texel.area;
    }
    return all && part.area * MOST_REPRESENTED >= area && !partly_covered(lit);
}

// One member of a group that settles: the others have their turn in the same batch, so that none of its light is missing, or
// there twice, for long.
Shooter member_of_group(ivec2 corner_px, int level, int member) {
    int one = min(level, patch_levels(corner_px).shoots);
    if (one < level) return shooter_from_patch(corner_px + (ivec2(member % GROUP, member / GROUP) << one), 1 << one);
    Shooter s = no_shooter();
    if (member == 0) s = shooter_from_patch(corner_px, 1 << one);
    return s;
}

// The patch itself, or of a group the representative, which shoots for all: the others settle later.
Shooter shooter_for(ivec2 corner_px, int level) {
    int one = min(level, patch_levels(corner_px).shoots), size = 1 << level;
    Shooter s = shooter_from_patch(one < level ? representative_of(corner_px, one) : corner_px, 1 << one);
    if (one == level) return s;
    vec3 flux;
    if (size_px(s) > 0 && is_even(s) && can_represent(corner_px, size, s, flux)) {
        s.exitance = flux / s.area;
        return s;
    }
    Texel lead;
    return shooter_from_patch(leading_texel(corner_px, size, lead) >> one << one, 1 << one);
}

void main() {
    const int TURNS = SETTLES == 1 ? GROUP * GROUP : 1;  // of one candidate
    int shot = int(gl_FragCoord.y), rank = shot / TURNS;
    vec4 chosen = ranked_bin(rank);
    Shooter s = no_shooter();
    if (chosen.x > u_least && (rank == 0 || chosen.x >= WEAKEST * ranked_bin(0).x)) {
        ivec2 corner_px = corner_of(chosen);
        int level = level_of(chosen);
        s = SETTLES == 1 ? member_of_group(corner_px, level, shot % TURNS) : shooter_for(corner_px, level);
    }
    out_row = size_px(s) > 0 ? shooter_row(s, int(gl_FragCoord.x)) : vec4(0.0);
}
