// The strongest patch of each row of tiles, and the row's power: (power, x, y, Σ power). One texel per row of tiles.
#define ROW_PATCHES 4

uniform sampler2D t_patches;
uniform int u_width;  // patches in a row

layout(location = 0) out vec4 out_row;

void main() {
    int first = int(gl_FragCoord.x) * ROW_PATCHES;
    vec3 best = vec3(0.0);
    float total = 0.0;
    for (int y = first; y < first + ROW_PATCHES; ++y)
        for (int x = 0; x < u_width; ++x) {
            float power = texelFetch(t_patches, ivec2(x, y), 0).r;
            total += power;
            if (power > best.x) best = vec3(power, x, y);
        }
    out_row = vec4(best, total);
}
