// The record of one shooter, made by choose.frag.glsl: a row of t_shooters. Declared in app/solvers/shooting/records.py.
#include <shooter>

int size_px(Shooter s) { return abs(s.signed_size); }  // edge of the patch [texels]; 0: no shot
ivec2 patch_px(Shooter s) { return ivec2(s.patch_x, s.patch_y); }  // lower corner of the patch in the tile pool [texels]

// Whether all its texels shoot the mean, and keep what they have above or below it.
bool is_even(Shooter s) { return s.signed_size > 0; }

Shooter load_shooter(sampler2D shooters, int shot) {
    vec4 rows[SHOOTER_ROWS];
    for (int row = 0; row < SHOOTER_ROWS; ++row) rows[row] = texelFetch(shooters, ivec2(row, shot), 0);
    return shooter_from_rows(rows);
}
