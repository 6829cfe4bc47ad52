// What a candidate is chosen by. Where a patch shot for its family, it owes the others, who have yet to shoot: were debts paid
// first, since they are large, or last, the scene would be darker or lighter than it is until then. So beyond u_most, power does
// not matter, and each member of a family has its turn, which is another's in families around.
#include "shooting/family.glsl"

uniform float u_most;

const float TURN = 1.0 / 256.0;  // of the rank

float rank_of(float power, ivec2 corner_px, int level) {
    ivec2 member = corner_px >> level & 1;
    return min(power, u_most) * (1.0 - TURN * float(member.x + 2 * member.y));
}
