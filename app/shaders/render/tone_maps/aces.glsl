// ACES reference rendering and output transforms, fitted by Stephen Hill (BakingLab, ACES.hlsl, MIT). As in three.js
// the scene is first brightened by 1/0.6, so that mid grey comes out near to where the other curves put it.
vec3 develop(vec3 rgb) {
    const mat3 rrt_from_rec709 = mat3(0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777);
    const mat3 rec709_from_odt = mat3(
        1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602);
    vec3 v = rrt_from_rec709 * min(rgb / 0.6, 1e6);
    vec3 fit = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
    return clamp(rec709_from_odt * fit, 0.0, 1.0);
}
