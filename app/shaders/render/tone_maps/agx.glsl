// AgX by Troy Sobotka (github.com/sobotka/AgX): inset in Rec.2020, log2 over 16.5 stops, sigmoid (sixth-order fit by
// Benjamin Wrensch, MIT), outset; matrices as in Filament and three.js, colour spaces as in ITU-R BT.2407.
vec3 develop(vec3 rgb) {
    const mat3 rec2020_from_rec709 = mat3(0.6274, 0.0691, 0.0164, 0.3293, 0.9195, 0.0880, 0.0433, 0.0113, 0.8956);
    const mat3 rec709_from_rec2020 = mat3(1.6605, -0.1246, -0.0182, -0.5876, 1.1329, -0.1006, -0.0728, -0.0083, 1.1187);
    const mat3 inset = mat3(
        0.856627153315983, 0.137318972929847, 0.11189821299995,
        0.0951212405381588, 0.761241990602591, 0.0767994186031903,
        0.0482516061458583, 0.101439036467562, 0.811302368396859);
    const mat3 outset = mat3(
        1.1271005818144368, -0.1413297634984383, -0.14132976349843826,
        -0.11060664309660323, 1.157823702216272, -0.11060664309660294,
        -0.016493938717834573, -0.016493938717834257, 1.2519364065950405);
    const float darkest_ev = -12.47393;
    const float brightest_ev = 4.026069;
    vec3 stops = log2(max(inset * (rec2020_from_rec709 * rgb), 1e-10));
    vec3 x = clamp((stops - darkest_ev) / (brightest_ev - darkest_ev), 0.0, 1.0);
    vec3 curve = ((((((15.5 * x - 40.14) * x + 31.96) * x - 6.868) * x + 0.4298) * x + 0.1191) * x) - 0.00232;
    return clamp(rec709_from_rec2020 * pow(max(outset * curve, 0.0), vec3(2.2)), 0.0, 1.0);
}
