// The strongest patch of each row of tiles, and the row's power: (power, corner x, y [texels], Σ power). One texel per row of tiles.
#define ROW_PATCHES 4

uniform sampler2D t_patches;
uniform int u_width;  // patches in a row

layout(location = 0) out vec4 out_row;

void main() {
    int first = int(gl_FragCoord.x) * ROW_PATCHES;
    out_row = vec4(0.0);
    for (int y = first; y < first + ROW_PATCHES; ++y)
        for (int x = 0; x < u_width; ++x) {
            vec4 patch_ = texelFetch(t_patches, ivec2(x, y), 0);
            out_row.w += patch_.w;
            if (patch_.x > out_row.x) out_row.xyz = patch_.xyz;
        }
}
