// The light of some directions is blended into H and r of every texel. A sample of a map sees the receiver if it shows its facet,
// or nothing that lies nearer to the light than the receiver's own plane there: the four around it, weighted bilinearly. What it
// shows below the sphere around the scene is the background. Where some of the four see it, the others hide it only if it is behind
// what they show; what shows another facet in the receiver's own plane is as in visibility/behind.glsl. So at places all over a
// texel.
#include "common/atlas.glsl"
#include "common/albedo.glsl"
#include "common/item.glsl"
#include "solvers/shooting/direction_shot.glsl"
#include "visibility/behind.glsl"
#include "visibility/texel_square.glsl"

uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_items;
uniform sampler2D t_depth;
uniform int u_shots;  // from u_first on
uniform int u_maps;   // that t_items has room for

layout(location = 0) out vec4 out_irradiance;  // a: as in receive.frag.glsl
layout(location = 1) out vec4 out_residual;

const float SLACK = 1.0 / 8192.0;  // of the scene's radius: rounding of depths, as in visibility/visible.glsl

// position: in the solver space; local, normal: in the axes of the map
float visible(vec3 position, vec3 local, vec3 normal, float facet, vec3 sight, int shot) {
    vec2 at = px_of(local) - 0.5, base = floor(at), f = at - base;
    vec2 uv = (base + 1.0 + vec2(0.0, MAP * float(shot))) / vec2(MAP, MAP * float(u_maps));
    vec4 x = vec4(0.0, 1.0, 1.0, 0.0) - f.x, y = vec4(1.0, 1.0, 0.0, 0.0) - f.y;  // [px] from the receiver, as textureGather has them
    vec4 plane = local.z - (normal.x * x + normal.y * y) / normal.z * (2.0 / (WIDTH * MAP));
    vec4 shown = (0.5 - textureGather(t_depth, uv)) / DEPTH;
    vec4 items = textureGather(t_items, uv);
    bvec4 same = equal(items, vec4(facet)), open = lessThanEqual(shown, max(plane + SLACK, -1.0));
    bvec4 seen = bvec4(same.x || open.x, same.y || open.y, same.z || open.z, same.w || open.w);
    vec4 weight = vec4((1.0 - f.x) * f.y, f.x * f.y, f.x * (1.0 - f.y), (1.0 - f.x) * (1.0 - f.y));
    vec4 beyond = plane - shown, other = vec4(not(same)) * vec4(notEqual(items, vec4(UNCHARTED)));
    bvec4 beside = bvec4(other * vec4(lessThanEqual(abs(beyond), vec4(SLACK))));
    if (any(beside)) {
        for (int i = 0; i < 4; ++i) {
            if (!beside[i]) continue;
            bool tells;
            seen[i] = sees_beside(items[i], facet, beyond[i], position, sight, tells);
            weight[i] *= float(tells);
        }
    }
    if (any(seen) && !all(seen)) {
        for (int i = 0; i < 4; ++i)
            if (!seen[i]) seen[i] = !behind(items[i], position, sight);
    }
    float told = dot(weight, vec4(1.0));
    return told > 0.0 ? dot(vec4(seen), weight) / told : 1.0;
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    Texel texel = load_texel(t_position_area, t_normal_ids, px);
    out_irradiance = out_residual = vec4(0.0);
    if (texel.area <= 0.0) return;
    vec3 u, v;
    bool square = fills_square(t_normal_ids, px, texel, u, v);
    for (int shot = 0; shot < u_shots; ++shot) {
        Shooter s = shooter_of(shot);
        mat3 axes = axes_of(s);
        vec3 normal = texel.normal * axes;
        if (normal.z <= 0.0) continue;
        vec4 light = normal.z * vec4(s.exitance, dot(abs(s.exitance), vec3(1.0)));
        int places = square ? places_of(s.patch_y) : 1;
        vec2 reach = square ? within_texel(u, v, s.normal, 2.0 / (WIDTH * MAP)) : vec2(0.0);
        float seen = 0.0;
        for (int nth = 0; nth < places; ++nth) {
            vec2 at = reach * place_of(s.patch_y, nth);
            vec3 position = texel.position + at.x * u + at.y * v;
            seen += visible(position, position * axes, normal, float(texel.facet), -s.normal, shot);
        }
        out_irradiance += light * seen / float(places);
        out_residual.a += light.a;
    }
    out_residual.rgb = albedo_of(t_materials, texel.material, px) * out_irradiance.rgb;
}
