// Texels of leaves from where they were to where they are.
#define INTEGER 0

#if INTEGER
uniform usampler2D t_source;
layout(location = 0) out uvec4 out_texel;
#else
uniform sampler2D t_source;
layout(location = 0) out vec4 out_texel;
#endif

flat in vec2 v_corner;
flat in vec2 v_from;

void main() { out_texel = texelFetch(t_source, ivec2(gl_FragCoord.xy - v_corner + v_from), 0); }
