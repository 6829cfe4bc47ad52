// What the shooters see: item, and depth along the sight. At FAR it loses against the open.
#include "common/item.glsl"
#include <fragment>

layout(location = 0) out float out_item;

void main() {
    vec2 seen = item_and_depth();
    out_item = seen.x;
    gl_FragDepth = seen.y / FAR;
}
