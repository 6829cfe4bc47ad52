// Places in the order of texels.
const uint LOST = 0x7FFFFFFFu;  // that of a texel without surface, and of what a lost ray hits: LOST of app/solvers/local/rows.py
