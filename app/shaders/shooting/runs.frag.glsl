// The strongest patch of each run of slots, and the run's power: (power, corner x, y [texels], Σ power). One texel per run.
#define TILE_PATCHES 4

uniform sampler2D t_patches;
uniform int u_runs;
uniform int u_slots;  // up to the last that is used

layout(location = 0) out vec4 out_run;

void main() {
    int run = int(gl_FragCoord.x), columns = textureSize(t_patches, 0).x / TILE_PATCHES;
    out_run = vec4(0.0);
    for (int slot = run * u_slots / u_runs; slot < (run + 1) * u_slots / u_runs; ++slot) {
        ivec2 corner = ivec2(slot % columns, slot / columns) * TILE_PATCHES;
        for (int k = 0; k < TILE_PATCHES * TILE_PATCHES; ++k) {
            vec4 patch_ = texelFetch(t_patches, corner + ivec2(k % TILE_PATCHES, k / TILE_PATCHES), 0);
            out_run.w += patch_.w;
            if (patch_.x > out_run.x) out_run.xyz = patch_.xyz;
        }
    }
}
