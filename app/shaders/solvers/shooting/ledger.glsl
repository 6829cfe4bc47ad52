// The ledger: one column for each shot of a batch, of all batches so far. Declared in app/solvers/shooting/records.py.
#include <ledger>

Ledger load_ledger(sampler2D ledger, int shot) {
    vec4 rows[LEDGER_ROWS];
    for (int row = 0; row < LEDGER_ROWS; ++row) rows[row] = texelFetch(ledger, ivec2(shot, row), 0);
    return ledger_from_rows(rows);
}
