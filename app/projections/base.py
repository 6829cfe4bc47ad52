"""What a projection is: a map of visibility around a shooter's normal, and the GLSL that draws and reads it.

A projection's GLSL file defines, for local positions in the shooter's frame (+z its normal) and texels (px) of its map:

    int   view_from_direction(vec3 local)         which view looks there
    int   view_from_px(vec2 px)
    vec3  view_from_local(int view, vec3 local)   in the view's own axes
    vec3  local_from_view(int view, vec3 v)
    vec2  px_from_view(int view, vec3 v)
    vec3  sight_from_px(int view, vec2 px)        v = sight · depth, in the view's own axes
    float depth_from_view(vec3 v)
    vec4  view_bounds_px(int view)
    float delta_form_factor(int view, vec2 px)    sums to 1 over the map

and its vertex side adds ``void project(int view, vec3 local)``. Solvers include either through the slot ``<projection>``.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Projection:
    """One row of the table. The map has (width, height)·resolution texels and is drawn with ``views`` instances."""

    name: str
    views: int
    width: int
    height: int

    @property
    def glsl(self) -> str:
        return f"projections/{self.name}.glsl"

    @property
    def clip_glsl(self) -> str:
        return f"projections/{self.name}_clip.glsl"

    def size(self, resolution: int) -> tuple[int, int]:
        return self.width * resolution, self.height * resolution
