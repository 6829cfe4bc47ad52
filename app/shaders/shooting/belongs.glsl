// Which texels of a patch shoot together: those that face the shooter's way and lie close to its plane. On a curved or
// folded patch the rest keeps its residual and shoots later.
const float COS_TOGETHER = 0.94;  // 20°: cosines of one polygon are then right within 6 %

bool belongs(Texel texel, vec3 normal, vec3 origin, float reach) {
    return texel.area > 0.0 && dot(texel.normal, normal) > COS_TOGETHER && distance(texel.position, origin) < reach;
}

// Largest extent of a patch of size² texels with these tangents: texels further apart belong to another chart.
float patch_reach(vec3 dpdu, vec3 dpdv, int size_px) { return 1.5 * float(size_px) * (length(dpdu) + length(dpdv)); }
