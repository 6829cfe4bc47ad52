// A point for each block that holds texels of lamps: what these have yet to shoot.
#include "common/atlas.glsl"
#include "solvers/shooting/block.glsl"

uniform usampler2D t_lamp_blocks;  // y << 16 | x of each
uniform sampler2D t_position_area;
uniform usampler2D t_normal_ids;
uniform sampler2D t_materials;
uniform sampler2D t_residual;

flat out vec3 v_unshot;

void main() {
    int width = textureSize(t_lamp_blocks, 0).x;
    uint packed_block = texelFetch(t_lamp_blocks, ivec2(gl_VertexID % width, gl_VertexID / width), 0).x;
    ivec2 corner_px = ivec2(packed_block & 0xFFFFu, packed_block >> 16) * BLOCK;
    v_unshot = vec3(0.0);
    for (int k = 0; k < BLOCK * BLOCK; ++k) {
        ivec2 px = corner_px + ivec2(k % BLOCK, k / BLOCK);
        uint material = material_from_ids(texelFetch(t_normal_ids, px, 0).y);
        vec3 E = texelFetch(t_materials, ivec2(1, int(material)), 0).rgb;
        float area = texelFetch(t_position_area, px, 0).w;
        if (area > 0.0 && E != vec3(0.0)) v_unshot += texelFetch(t_residual, px, 0).rgb * area;
    }
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
    gl_PointSize = 1.0;
}
