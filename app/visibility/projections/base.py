"""What a projection is: a map of visibility around a shooter's normal, and the GLSL that draws and reads it.

The GLSL file of its map defines, for local positions in the shooter's frame (+z its normal) and texels (px) of the map:

    int   view_from_direction(vec3 local)         which view looks there
    int   view_from_px(vec2 px)
    vec3  view_from_local(int view, vec3 local)   in the view's own axes
    vec3  local_from_view(int view, vec3 v)
    vec2  px_from_view(int view, vec3 v)          the nearest of its four texels is on the hemisphere, if v is
    vec3  sight_from_px(int view, vec2 px)        v = sight · depth, in the view's own axes
    float depth_from_view(vec3 v)
    vec4  view_bounds_px(int view)
    vec4  sights_dot(int view, vec2 px, vec3 n)   of the four texels around px, in the order of textureGather
    vec4  on_hemisphere(vec2 px)                  1 for each of those four that is, else 0: not to be looked up
    float delta_form_factor(int view, vec2 px)    sums to 1 over the map; 0 off the hemisphere

Its vertex file adds what draws one vertex of a caster into the map of one shot, of so many that lie above each other, and its
fragment file what that shows; at FAR it loses against the open:

    void  draw(int view, vec3 origin, mat3 axes, float facet, int shot, int shots)
    vec2  item_and_depth()

Solvers include these through the slots ``<projection>``, ``<vertex>`` and ``<fragment>``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from app.visibility.occluders import Casters, Occluders


@dataclass(frozen=True)
class Projection:
    """One row of the table. The map has (width, height)·resolution texels and is drawn with ``views`` instances.

    map: name of the GLSL file that reads it; clip_distances: that the vertex file writes; casters: what it draws, for a
    resolution.
    """

    name: str
    map: str
    views: int
    width: int
    height: int
    clip_distances: int
    casters: Callable[[Occluders, int], Casters]

    @property
    def glsl(self) -> str:
        return f"visibility/projections/{self.map}.glsl"

    @property
    def drawing(self) -> dict[str, str]:
        """Files for the slots of the program that draws the map."""
        return {stage: f"visibility/projections/{self.name}_{stage}.glsl" for stage in ("vertex", "fragment")}

    def size(self, resolution: int) -> tuple[int, int]:
        return self.width * resolution, self.height * resolution
