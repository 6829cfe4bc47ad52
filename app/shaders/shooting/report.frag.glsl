// What the host hears of a batch, in one small late read-back: texel 0 (Σ residual power before the batch, best patch, 0, 0),
// 1 the ledger so far, 2.. the rows of the first shooter.
uniform sampler2D t_runs;
uniform sampler2D t_ledger;
uniform sampler2D t_shooters;

layout(location = 0) out vec4 out_report;

void main() {
    int entry = int(gl_FragCoord.x);
    if (entry == 0) {
        vec2 sum = vec2(0.0);
        for (int i = 0; i < textureSize(t_runs, 0).x; ++i) {
            vec4 run = texelFetch(t_runs, ivec2(i, 0), 0);
            sum = vec2(sum.x + run.w, max(sum.y, run.x));
        }
        out_report = vec4(sum, 0.0, 0.0);
    } else if (entry == 1) {
        out_report = vec4(0.0);
        for (int shot = 0; shot < textureSize(t_ledger, 0).x; ++shot) out_report += texelFetch(t_ledger, ivec2(shot, 0), 0);
    } else {
        out_report = texelFetch(t_shooters, ivec2(entry - 2, 0), 0);
    }
}
