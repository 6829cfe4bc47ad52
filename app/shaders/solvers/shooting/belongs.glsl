// Which texels of a patch shoot together: those of one chart that face the shooter's way. Small charts share patches, and may be
// of other rooms. The rest keeps its residual and shoots later.
#include "common/facet.glsl"

const float COS_TOGETHER = 0.94;  // 20°: cosines of one polygon are then right within 6 %

bool belongs(Texel texel, vec3 normal, float chart) {
    return texel.area > 0.0 && dot(texel.normal, normal) > COS_TOGETHER && chart_of(texel.facet) == chart;
}
