// A small triangle is drawn into the map of visibility, or counted.
#include "common/item.glsl"
#define COUNT 0

flat in vec2 v_seen;

layout(location = 0) out float out_item;

void main() {
#if COUNT
    out_item = 1.0;
#else
    out_item = v_seen.x;
    gl_FragDepth = depth_in_map(v_seen);
#endif
}
