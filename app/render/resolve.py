"""Display texels: a layer on every texel, developed for the screen, in tiles with a border that the sampler interpolates.

Doing exposure, tone curve and sRGB here leaves one look-up per pixel: that is what holds 30 frames/s on a software
rasteriser. A texel that covers nothing copies a neighbour, so that no gutter or tile border darkens the picture.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from app.atlas.lightmap import Lightmap
from app.atlas.node_set import TABLE_WIDTH, NodeSet
from app.atlas.quadtree import SIDES
from app.gpu import Gpu, Mesh, Pass, Texture
from app.render.develop import curve
from app.render.false_colour import Scale
from app.render.layers import LAYER_SHADERS, Layer
from app.render.options import DisplayOptions
from app.render.targets import release_targets
from app.scene.model import F32, RGB

TEXELS_PER_FRAME = 1 << 17  # that are brought up to date in one frame, where not all must be
T = TypeVar("T")


class DisplayTexels:
    """The display texels of one lightmap. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap) -> None:
        self._gpu, self._lightmap = gpu, lightmap
        self.size = display_size(lightmap)
        self._colour = gpu.texture(self.size, 4, "f1")
        self._target = gpu.target(self._colour)
        self._target.clear()
        sides = np.array([m.double_sided for m in lightmap.scene.materials], np.uint32)
        self._unlit = gpu.texture((len(sides), 2), 4, "f1")
        self._unlit_target = gpu.target(self._unlit)
        self._tables = {
            "t_sides": gpu.texture((len(sides), 1), 1, "u4", sides.tobytes()),
            "t_charts": self._chart_table(),
            "t_places": self._place_table(),
            "t_source": gpu.texture(self.size, 1, "u4"),
        }
        self._version = lightmap.version
        self._edges: Mesh | None = None
        self._find_edges()
        self._find_sources = Pass(gpu, "render/source", defines=lightmap.defines("TILE"))
        self._source_target = gpu.target(self._tables["t_source"])
        self._sourced_rows = 0
        self._passes: dict[tuple[str, Layer, str], Pass] = {}
        self._next_row = 0

    @property
    def fits(self) -> bool:
        """Whether the lightmap is still as large as it was."""
        return self.size == display_size(self._lightmap)

    def resolve(
        self, layer_name: str, display: DisplayOptions, *, scale: Scale | None, ambient: RGB, whole: bool
    ) -> dict[str, Texture]:
        """Bring the display texels up to date; the textures that surfaces bind.

        If not ``whole``, TEXELS_PER_FRAME of them, in turn.
        """
        layer, lightmap = LAYER_SHADERS[layer_name], self._lightmap
        if self._version != lightmap.version:
            self._follow_leaves()
        shader, uniforms = curve(display, scale, exposed=layer.light is not None)
        first, rows = self._band(whole)
        uniforms |= {
            "u_unit": lightmap.unit,
            "u_ambient": ambient,
            "u_target_texel": 1.0 / (lightmap.charts.density * lightmap.frame.scale),
        }
        names = ("t_normal_ids", "t_materials", "t_albedo", "t_emission", "t_facets", "t_leaves")
        textures = self._tables | lightmap.textures(*names)
        textures |= {"t_light": lightmap.texture(layer.light)} if layer.light else {}
        for name, target, viewport in (
            ("unlit", self._unlit_target, (0, 0, *self._unlit.size)),
            ("resolve", self._target, (0, first, self.size[0], rows)),
        ):
            resolve = self._pass(name, layer, shader)
            bound, values = declared(resolve, textures), declared(resolve, uniforms)
            resolve.draw(target, textures=bound, uniforms=values, viewport=viewport)
        if self._edges is not None:
            edges = self._pass("edges", layer, shader)
            uniforms |= {"u_size": self.size, "u_pages": self._pages}
            textures |= lightmap.textures("t_pages", "t_position_area")
            edges.draw(
                self._target, textures=declared(edges, textures), uniforms=declared(edges, uniforms), mesh=self._edges
            )
        smooth = layer.smooth and display.smooth
        filtering = self._gpu.ctx.LINEAR if smooth else self._gpu.ctx.NEAREST
        self._colour.filter = (filtering, filtering)
        return {"t_display": self._colour, "t_unlit": self._unlit, "t_places": self._tables["t_places"]}

    def _follow_leaves(self) -> None:
        """The leaves have changed: find everything anew, all at once, or a band would show texels of others."""
        self._version = self._lightmap.version
        self._tables.pop("t_places").release()
        self._tables["t_places"] = self._place_table()
        self._find_rows(0, self.size[1])
        self._find_edges()

    def _find_edges(self) -> None:
        """Where leaves meet those of another level."""
        if self._edges is not None:
            self._gpu.release_all(self._edges)
        edges = unequal_edges(self._lightmap.nodes)
        self._edges = Mesh(self._gpu, edges.tobytes(), EDGE_FORMAT, per_instance=True) if len(edges) else None

    @property
    def _pages(self) -> tuple[float, float]:
        return float(self._lightmap.columns), self._lightmap.nodes.pages_per_texel

    def release(self) -> None:
        release_targets(self._gpu, self._target, self._unlit_target, self._source_target)
        if self._edges is not None:
            self._gpu.release_all(self._edges)
        for texture in (self._colour, self._unlit, *self._tables.values()):
            texture.release()

    def _band(self, whole: bool) -> tuple[int, int]:
        """First row and number of rows to resolve now; their sources are there."""
        height = self.size[1]
        rows = height if whole else max(1, min(height, TEXELS_PER_FRAME // self.size[0]))
        first = self._next_row if rows < height else 0
        rows = min(rows, height - first)
        end = first + rows
        if end > self._sourced_rows:
            self._find_rows(self._sourced_rows, end)
        self._next_row = end % height
        return first, rows

    def _find_rows(self, first: int, end: int) -> None:
        """The sources of these rows of display texels."""
        self._find_sources.draw(
            self._source_target,
            textures=self._lightmap.textures("t_pages", "t_leaves", "t_position_area"),
            uniforms={"u_pages": self._pages},
            viewport=(0, first, self.size[0], end - first),
        )
        self._sourced_rows = end

    def _pass(self, name: str, layer: Layer, shader: str) -> Pass:
        key = name, layer, shader
        if key not in self._passes:
            own = () if name == "unlit" else ("TILE",)
            defines = self._lightmap.defines(*layer.defines, *own)
            slots = {"layer": f"render/layers/{layer.shader}.glsl", "curve": f"render/{shader}.glsl"}
            self._passes[key] = Pass(self._gpu, f"render/{name}", defines=defines, slots=slots, label=name)
        return self._passes[key]

    def _chart_table(self) -> Texture:
        """The chart of each facet (from 1), R32UI, TABLE_WIDTH wide."""
        charts = self._lightmap.charts
        rows = -(-(charts.facet_count + 1) // TABLE_WIDTH)
        chart_of_facet = np.zeros(rows * TABLE_WIDTH, np.uint32)
        chart_of_facet[charts.face_facet + 1] = charts.face_chart
        return self._gpu.texture((TABLE_WIDTH, rows), 1, "u4", chart_of_facet.tobytes())

    def _place_table(self) -> Texture:
        """For each page of the atlas, the display texel of a place uv [texels of level 0]: z·uv + (x, y), RGBA32F."""
        nodes = self._lightmap.nodes
        pages = nodes.slot_tables["t_pages"][..., 0].astype(np.int64)
        slot = np.maximum(pages - 1, 0)
        first = np.stack([slot % nodes.columns, slot // nodes.columns], -1) * bordered(nodes) + 1
        tile = np.stack([nodes.leaves.x[slot], nodes.leaves.y[slot]], -1)
        places = np.zeros((*pages.shape, 4), np.float32)
        places[..., :2] = first - tile * nodes.tile
        places[..., 2] = 2.0 ** nodes.leaves.level[slot]
        return self._gpu.texture(pages.shape[::-1], 4, "f4", places.tobytes())


def bordered(nodes: NodeSet) -> int:
    """Display texels along the edge of a leaf: one more on each side."""
    return nodes.tile + 2


def display_size(lightmap: Lightmap) -> tuple[int, int]:
    """Display texels of the whole node set."""
    return lightmap.columns * bordered(lightmap.nodes), lightmap.rows * bordered(lightmap.nodes)


EDGE_FORMAT = {"in_rect": "4f", "in_outward": "3f"}


def unequal_edges(nodes: NodeSet) -> F32:
    """(n, 7) f32 instances of EDGE_FORMAT: half edges of leaves that meet a leaf of another level."""
    if nodes.depth == 0:
        return np.zeros((0, 7), np.float32)
    slots = np.flatnonzero(nodes.used)
    level = nodes.leaves.level[slots]
    pages = np.pad(nodes.slot_tables["t_pages"][..., 0].astype(np.int64), 1)
    side = 1 << (nodes.depth - level)  # pages along an edge of each leaf
    left, bottom = nodes.leaves.x[slots] * side + 1, nodes.leaves.y[slots] * side + 1
    corner = np.stack([slots % nodes.columns, slots // nodes.columns], 1) * bordered(nodes)
    last, length = bordered(nodes) - 1, nodes.tile // 2
    found = []
    for dx, dy in SIDES:
        for half in (0, 1):
            along = side // 4 + half * (side // 2)
            x = left + (along if dy else np.where(dx > 0, side, -1))
            y = bottom + (along if dx else np.where(dy > 0, side, -1))
            near = pages[y, x] - 1
            finer = np.where(near >= 0, nodes.leaves.level[near] - level, 0)
            which = np.flatnonzero(finer != 0)
            start = 1 + half * length
            place = (last * (dx > 0), start) if dx else (start, last * (dy > 0))
            extent = (1, length) if dx else (length, 1)
            count = len(which)
            found.append(
                np.column_stack([corner[which] + place, np.tile([*extent, dx, dy], (count, 1)), np.sign(finer[which])])
            )
    return np.concatenate(found).astype(np.float32)


def declared(program: Pass, offered: dict[str, T]) -> dict[str, T]:
    """Those of the offered that a program made of slots declares: what it lacks is its slot's choice."""
    names = set(program.program)
    return {name: value for name, value in offered.items() if name in names}
