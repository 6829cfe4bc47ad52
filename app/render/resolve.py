"""Display texels: a layer on every texel, developed for the screen, in tiles with a border, which the sampler interpolates.

Doing exposure, tone curve and sRGB here leaves one look-up per pixel: that is what holds 30 frames/s on a software
rasteriser. A texel that covers nothing copies a neighbour, so that no gutter or tile border darkens the picture.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from app.atlas.lightmap import Lightmap
from app.atlas.node_set import TABLE_WIDTH
from app.gpu import Gpu, Mesh, Pass, Texture
from app.render.ages import LeafAges
from app.render.develop import curve
from app.render.edges import EDGE_FORMAT, unequal_edges
from app.render.false_colour import Scale
from app.render.layers import LAYER_SHADERS, Layer
from app.render.options import DisplayOptions
from app.render.targets import release_targets
from app.scene.model import RGB

# Texels around each tile: as many as interpolation at its edge reaches beyond it
BORDER = {"nearest": 1, "bilinear": 1, "bicubic": 2}
TEXELS_PER_FRAME = 1 << 17  # that are brought up to date in one frame, where not all must be
T = TypeVar("T")


class DisplayTexels:
    """The display texels of one lightmap; border: see BORDER. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, ages: LeafAges, border: int) -> None:
        self._gpu, self._lightmap, self._ages, self._border = gpu, lightmap, ages, border
        self.size = display_size(lightmap, border)
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
        self._edges: dict[bool, Mesh] = {}
        self._find_edges()
        self._find_sources = Pass(gpu, "render/source", defines=lightmap.defines("TILE") | {"BORDER": border})
        self._source_target = gpu.target(self._tables["t_source"])
        self._sourced_rows = 0
        self._passes: dict[tuple[object, ...], Pass] = {}
        self._next_row = 0

    def fits(self, border: int) -> bool:
        """Whether the lightmap is still as large as it was, and the border as wide as it shall be."""
        return self.size == display_size(self._lightmap, border) and self._border == border

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
        uniforms |= {"u_size": self.size, "u_pages": self._pages, "u_border": self._border}
        textures |= lightmap.textures("t_pages", "t_position_area")
        for follows, mesh in self._edges.items():
            edges = self._pass("edges", layer, shader, FOLLOWS=follows)
            bound, values = declared(edges, textures), declared(edges, uniforms)
            edges.draw(self._target, textures=bound, uniforms=values, mesh=mesh, scissor=(0, first, self.size[0], rows))
        smooth = layer.smooth and display.interpolation != "nearest"
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
        self._gpu.release_all(*self._edges.values())
        edges = unequal_edges(self._lightmap.nodes, self._border)
        self._edges = {
            follows: Mesh(self._gpu, some.tobytes(), EDGE_FORMAT, per_instance=True) for follows, some in edges.items()
        }

    @property
    def _pages(self) -> tuple[float, float]:
        return float(self._lightmap.columns), self._lightmap.nodes.pages_per_texel

    def release(self) -> None:
        release_targets(self._gpu, self._target, self._unlit_target, self._source_target)
        self._gpu.release_all(*self._edges.values())
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

    def _pass(self, name: str, layer: Layer, shader: str, **more: bool) -> Pass:
        key = name, layer, shader, *more.values()
        if key not in self._passes:
            own = ("TILE",) if name == "edges" else ()
            defines = self._lightmap.defines(*layer.defines, *own) | more
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
        """For each page of the atlas, the display texel of a place uv [texels of level 0]: z·uv + (x, y), z 0 where no leaf is;
        and when its leaf was split off, see LeafAges. RGBA32F."""
        nodes = self._lightmap.nodes
        pages = nodes.slot_tables["t_pages"][..., 0].astype(np.int64)
        slot = np.maximum(pages - 1, 0)
        first = (
            np.stack([slot % nodes.columns, slot // nodes.columns], -1) * (nodes.tile + 2 * self._border) + self._border
        )
        tile = np.stack([nodes.leaves.x[slot], nodes.leaves.y[slot]], -1)
        places = np.zeros((*pages.shape, 4), np.float32)
        places[..., :2] = first - tile * nodes.tile
        places[..., 2] = np.where(pages > 0, 2.0 ** nodes.leaves.level[slot], 0.0)
        places[..., 3] = self._ages.born(nodes)
        return self._gpu.texture(pages.shape[::-1], 4, "f4", places.tobytes())


def display_size(lightmap: Lightmap, border: int) -> tuple[int, int]:
    """Display texels of the whole node set."""
    bordered = lightmap.nodes.tile + 2 * border
    return lightmap.columns * bordered, lightmap.rows * bordered


def declared(program: Pass, offered: dict[str, T]) -> dict[str, T]:
    """Those of the offered that a program made of slots declares: what it lacks is its slot's choice."""
    names = set(program.program)
    return {name: value for name, value in offered.items() if name in names}
