// What each slot of the tile pool holds: tile x, y at its level, size of a texel [texels of level 0]; size 0: nothing.
uniform sampler2D t_leaves;
