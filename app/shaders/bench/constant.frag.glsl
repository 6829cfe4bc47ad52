// Nothing but a fragment: one colour, which leaves what it is blended with as it is.
layout(location = 0) out vec4 out_colour;

void main() { out_colour = vec4(0.0); }
