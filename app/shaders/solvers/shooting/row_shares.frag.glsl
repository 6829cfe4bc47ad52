// The sums of tile_shares.frag.glsl over each row of tiles.
uniform sampler2D t_first;
uniform sampler2D t_last;

layout(location = 0) out vec4 out_first;
layout(location = 1) out vec4 out_last;

void main() {
    int row = int(gl_FragCoord.y);
    out_first = out_last = vec4(0.0);
    for (int x = 0; x < textureSize(t_first, 0).x; ++x) {
        out_first += texelFetch(t_first, ivec2(x, row), 0);
        out_last += texelFetch(t_last, ivec2(x, row), 0);
    }
}
