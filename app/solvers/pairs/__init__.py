"""Texel pairs, Kahl's own modes: every texel gathers from every other or from what stands for windows of them; see solver.py."""
