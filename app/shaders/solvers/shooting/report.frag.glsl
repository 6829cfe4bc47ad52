// What the host hears of a batch, in one small late read-back: texel 0 (unshot power before the batch, that of all patches with
// what is shot ahead, that of the strongest, 0), 1 the ledger so far, 2.. the rows of the first shooter.
uniform sampler2D t_runs;
uniform sampler2D t_unshot;
uniform sampler2D t_ledger;
uniform sampler2D t_shooters;

layout(location = 0) out vec4 out_report;

void main() {
    int entry = int(gl_FragCoord.x);
    if (entry == 0) {
        out_report = vec4(0.0);
        for (int i = 0; i < textureSize(t_runs, 0).x; ++i) {
            out_report.x += texelFetch(t_unshot, ivec2(i, 0), 0).a;
            vec4 run = texelFetch(t_runs, ivec2(i, 0), 0);
            out_report.y += run.a;
            out_report.z = max(out_report.z, run.x);
        }
    } else if (entry == 1) {
        out_report = vec4(0.0);
        for (int shot = 0; shot < textureSize(t_ledger, 0).x; ++shot) out_report += texelFetch(t_ledger, ivec2(shot, 0), 0);
    } else {
        out_report = texelFetch(t_shooters, ivec2(entry - 2, 0), 0);
    }
}
