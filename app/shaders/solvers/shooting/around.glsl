// The four gather points around a texel, found once: column | row << 16 of each.
const uint NO_POINT = 0xFFFFFFFFu;  // none of its chart there: that sees other things
const uint NO_TEXEL = 0xFFFFFFFEu;  // the texel itself covers nothing
