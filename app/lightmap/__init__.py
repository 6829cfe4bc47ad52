"""The light on every texel, on the GPU, in tiles that quadtrees may refine."""
