// What a visibility map shows: item, and depth along the sight. At FAR it loses against the open. Includes <fragment> before.
#include "common/item.glsl"

layout(location = 0) out float out_item;

void main() {
    vec2 seen = item_and_depth();
    out_item = seen.x;
    gl_FragDepth = seen.y / FAR;
}
