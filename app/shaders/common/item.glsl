// Items of the visibility map: 0 is the open background, else a facet (from 1), or a side that has no texels.
// Held as floats, exact up to 2^24, because an integer target cannot be cleared portably.
const float OPEN = 0.0;
const float UNCHARTED = 16777215.0;
const float FAR = 2.0;  // the scene's diameter in the solver space
// Rounding of positions and of their dot products in single precision, a few 2^-24 of the scene's diameter: two surfaces that are
// closer than this lie in one plane, and nothing nearer to the shooter can be told from its own surface.
const float COPLANAR = 2e-6;

// How deep a sample of a map lies that shows an item at a depth along its sight, in units of FAR. A side without texels is drawn a
// little behind its place: of two back to back the one that faces the shooter is seen, not the black back of the other.
float depth_in_map(vec2 item_and_depth) {
    return item_and_depth.y / FAR * (item_and_depth.x == UNCHARTED ? 1.0 + 1.0 / 65536.0 : 1.0);
}
