// Texels of one texture into another.
uniform sampler2D t_source;
uniform ivec2 u_offset_px;  // of the source, from where they go

layout(location = 0) out vec4 out_texel;

void main() { out_texel = texelFetch(t_source, ivec2(gl_FragCoord.xy) + u_offset_px, 0); }
