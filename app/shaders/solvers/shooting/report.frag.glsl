// What the host learns of a batch, in one small read-back that it looks at later: a Report, then the rows of the first shooter.
#include "solvers/shooting/ledger.glsl"
#include <report>

uniform sampler2D t_bins;
uniform sampler2D t_unshot;
uniform sampler2D t_ledger;
uniform sampler2D t_shooters;

layout(location = 0) out vec4 out_row;

void main() {
    int row = int(gl_FragCoord.x);
    if (row >= REPORT_ROWS) {
        out_row = texelFetch(t_shooters, ivec2(row - REPORT_ROWS, 0), 0);
        return;
    }
    Report report = Report(0.0, 0.0, 0.0, vec3(0.0), 0.0, vec3(0.0));
    for (int i = 0; i < textureSize(t_bins, 0).x; ++i) {
        report.unshot += texelFetch(t_unshot, ivec2(i, 0), 0).a;
        vec4 bin = texelFetch(t_bins, ivec2(i, 0), 0);
        report.to_shoot += bin.a;
        report.strongest = max(report.strongest, bin.x);
    }
    for (int shot = 0; shot < textureSize(t_ledger, 0).x; ++shot) {
        Ledger entry = load_ledger(t_ledger, shot);
        report.escaped += entry.escaped;
        report.shots += entry.shots;
        report.directions += entry.directions;
    }
    out_row = report_row(report, row);
}
