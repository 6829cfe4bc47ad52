"""Display texels: a layer on every texel, developed for the screen, in tiles with a border, which the sampler interpolates.

Doing exposure, tone curve and sRGB here leaves one look-up per pixel: that is what holds 30 frames/s on a software
rasteriser. A texel that covers nothing copies a neighbour, so that no gutter or tile border darkens the picture.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.gpu import Framebuffer, Gpu, Mesh, Pass, Texture
from app.gpu.shader import FULLSCREEN
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import EVEN_AMBIENT, QUAD_FORMAT, quads, upload, write_pages
from app.lightmap.tile_pool import TABLE_WIDTH
from app.render.ages import LeafAges
from app.render.edge_texels import EdgeTexels
from app.render.edges import Kind, reached_from
from app.render.false_colour import Scale
from app.render.layers import LAYER_SHADERS, Layer
from app.render.options import DisplayOptions
from app.render.seam_texels import DisplaySeams
from app.render.tone_mapping import curve

# Texels around each tile: as many as interpolation at its edge reaches beyond it
BORDER = {"nearest": 1, "bilinear": 1, "bicubic": 2}
TEXELS_PER_FRAME = 1 << 16  # that are brought up to date in one frame, where not all must be
SWITCHED_PER_FRAME = 4 * TEXELS_PER_FRAME  # of another layer or exposure
LAYER_TABLES = ("t_normal_ids", "t_materials", "t_albedo", "t_emission", "t_facets", "t_leaves", "t_ambient")
PLACES_WIDTH = 256  # of the table of places; pixels divide by it: a constant, a power of two
T = TypeVar("T")


class Reference(NamedTuple):
    """The light of a reference on every texel of a lightmap, RGBA32F [W/m²], and the length of a colour that counts as dark."""

    texture: Texture
    dark: float


class DisplayTexels:
    """The display texels of one lightmap; border: see BORDER. linear: they hold light as it is, exposed, and pixels develop it.
    Whoever makes it releases it.

    ready: whether all of them show the layer that was asked for last.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, ages: LeafAges, border: int, *, linear: bool = False) -> None:
        self._gpu, self._lightmap, self._ages, self._border = gpu, lightmap, ages, border
        self.size = display_size(lightmap, border)
        self._linear, dtype = linear, "f4" if linear else "f1"
        self._colour = gpu.texture(self.size, 4, dtype)
        self._target = gpu.target(self._colour)
        self._target.clear()
        sides = np.array([m.double_sided for m in lightmap.scene.materials], np.uint32)
        self._unlit = gpu.texture((len(sides), 2), 4, dtype)
        self._unlit_target = gpu.target(self._unlit)
        self._unlit_of: object = None  # what it shows
        self._version, self._keys = lightmap.version, self._leaf_keys()
        self._nothing = gpu.texture(EVEN_AMBIENT, 4, "f4", bytes(48))
        self._tables = {
            "t_sides": gpu.texture((len(sides), 1), 1, "u4", sides.tobytes()),
            "t_charts": self._chart_table(),
            "t_shown_pages": upload(gpu, lightmap.pool.slot_tables["t_pages"]),
            "t_places": gpu.texture((PLACES_WIDTH, len(self._keys) // PLACES_WIDTH + 1), 4, "f4"),
            "t_source": gpu.texture(self.size, 1, "u4"),
        }
        self._write_places()
        self._edges = EdgeTexels(gpu, lightmap, border, dtype)
        self._seams = DisplaySeams(gpu, lightmap, border)
        self._stale = np.empty(0, np.int64)  # slots whose display texels are of other leaves
        defines = lightmap.defines("TILE") | {"BORDER": border}
        self._find_sources = Pass(gpu, "render/source", defines=defines)
        self._find_some = Pass(gpu, "render/source", defines=defines, vertex="common/rects")
        self._source_target = gpu.target(self._tables["t_source"])
        self._sourced_rows = 0
        self._passes: dict[tuple[object, ...], Pass] = {}
        self._next_row = 0
        self._layer: object = None  # what they show, and how it is developed
        self._developed: object = None
        self._due = 0  # rows that still show another layer, or are developed otherwise
        self.ready = False

    def fits(self, border: int) -> bool:
        """Whether the lightmap is still as large as it was, and the border as wide as it shall be."""
        return self.size == display_size(self._lightmap, border) and self._border == border

    def resolve(
        self,
        layer_name: str,
        display: DisplayOptions,
        *,
        scale: Scale | None,
        whole: bool,
        reference: Reference | None = None,
        offered: Mapping[str, Texture] | None = None,
        instead: bool = False,
    ) -> dict[str, Texture]:
        """Bring the display texels up to date; the textures that surfaces bind.

        If not ``whole``, those of leaves that have changed, and TEXELS_PER_FRAME others, in turn, or SWITCHED_PER_FRAME as long
        as some show another layer, or another exposure. reference: for layers that compare, or, ``instead``, to be shown in place
        of the lightmap's irradiance. offered: for layers that a solver must offer.
        """
        layer, lightmap = LAYER_SHADERS[layer_name], self._lightmap
        if self._version != lightmap.version:
            self._follow_leaves()
        shader, uniforms = curve(display, scale, exposed=layer.light is not None)
        shows = layer_name, shader, instead, lightmap.ambients if layer.light is not None else 0
        first, rows = self._band(whole, shows, uniforms)
        uniforms |= {
            "u_unit": lightmap.unit,
            "u_target_texel": 1.0 / (lightmap.charts.density * lightmap.space.scale),
            "u_metre": 1.0 / lightmap.space.scale,
        }
        textures = self._tables | lightmap.textures(*LAYER_TABLES)
        textures |= {"t_light": lightmap.texture(layer.light)} if layer.light else {}
        textures |= {"t_offered": (offered or {})[layer.offered]} if layer.offered else {}
        if reference is not None:
            textures["t_reference"], uniforms["u_dark"] = reference
        if reference is not None and instead:
            textures["t_light"], uniforms["u_unit"] = reference.texture, 1.0
            textures["t_ambient"] = self._nothing  # what is unshot is the solution's
        uniforms |= {"u_size": self.size, "u_pages": self._pages}
        textures |= lightmap.textures("t_pages", "t_position_area")

        def draw(name: str, target: Framebuffer, *, rects: bool = False, **more: Any) -> None:
            program = self._pass(name, layer, shader, rects, **more.pop("defines", {}))
            bound, values = textures | more.pop("textures", {}), uniforms | more.pop("uniforms", {})
            program.draw(target, textures=declared(program, bound), uniforms=declared(program, values), **more)

        def make_edges(
            kind: Kind, target: Framebuffer, values: Mapping[str, object], own: Mapping[str, Texture]
        ) -> None:
            draw("edges", target, uniforms=values, textures=own, defines={"FOLLOWS": kind.follows})

        shown = layer_name, shader, instead, tuple(uniforms.items()), self._gpu.shaders.generation
        if (shown, lightmap.scene) != self._unlit_of:
            draw("unlit", self._unlit_target)
            self._unlit_of = shown, lightmap.scene
        band = 0, first, self.size[0], rows
        if len(self._stale) and rows < self.size[1]:  # their borders between levels come with their band
            rects = self._quads(self._stale)
            draw("resolve", self._target, rects=True, mesh=rects)
            rects.release()
        draw("resolve", self._target, viewport=band)
        self._edges.draw(self._target, first, first + rows, make_edges)
        self._stale = self._stale[:0]
        smooth = layer.smooth and display.interpolation != "nearest"
        if smooth and layer.light is not None:
            self._seams.draw(first, first + rows, lambda mesh: draw("seams", self._target, mesh=mesh, scissor=band))
        filtering = self._gpu.ctx.LINEAR if smooth else self._gpu.ctx.NEAREST
        self._colour.filter = (filtering, filtering)
        names = ("t_shown_pages", "t_places")
        return {"t_display": self._colour, "t_unlit": self._unlit} | {name: self._tables[name] for name in names}

    def _follow_leaves(self) -> None:
        """The leaves have changed: find anew what the display texels of the new ones copy, and of those around them."""
        pool, keys = self._lightmap.pool, self._leaf_keys()
        changed = np.flatnonzero(keys != self._keys)
        self._version, self._keys = self._lightmap.version, keys
        changed = changed[changed < pool.tiles]
        self._tables["t_shown_pages"] = write_pages(self._gpu, self._tables["t_shown_pages"], pool, changed)
        self._write_places()
        touched = reached_from(pool, changed, 2 * self._border)
        rects = self._quads(touched)
        self._find_some.draw(
            self._source_target,
            uniforms={"u_pages": self._pages, "u_size": self.size},
            mesh=rects,
            textures=self._source_tables,
        )
        rects.release()
        self._edges.follow(touched)
        self._seams.follow()
        self._stale = np.union1d(self._stale, changed)

    def _leaf_keys(self) -> NDArray[np.int64]:
        """The tile in each slot, and of those that the last row lacks."""
        pool = self._lightmap.pool
        keys = np.full(pool.columns * pool.rows, -1)
        keys[: pool.tiles] = pool.leaves.keys
        return keys

    def _quads(self, slots: NDArray[np.int64]) -> Mesh:
        """The display texels of these slots."""
        bordered = self._lightmap.pool.tile + 2 * self._border
        corner = np.stack([slots % self._lightmap.columns, slots // self._lightmap.columns], 1) * bordered
        return Mesh(self._gpu, quads(corner, bordered, corner).tobytes(), QUAD_FORMAT, per_instance=True)

    @property
    def _source_tables(self) -> dict[str, Texture]:
        return self._lightmap.textures("t_pages", "t_leaves", "t_position_area")

    @property
    def _pages(self) -> tuple[float, float]:
        return float(self._lightmap.columns), self._lightmap.pool.pages_per_texel

    def release(self) -> None:
        self._edges.release()
        self._seams.release()
        targets = (self._target, self._unlit_target, self._source_target)
        self._gpu.release_all(*targets, self._colour, self._unlit, self._nothing, *self._tables.values())

    def forget(self) -> None:
        """They were not shown for a while: all are brought up to date before they are again."""
        self._layer, self.ready = None, False

    def _band(self, whole: bool, layer: object, developed: Mapping[str, object]) -> tuple[int, int]:
        """First row and number of rows to resolve now; their sources are there. Counts those that still show another layer."""
        height = self.size[1]
        if layer != self._layer or developed != self._developed:
            self._due, self.ready = height, self.ready and layer == self._layer
            self._layer, self._developed = layer, dict(developed)
        texels = SWITCHED_PER_FRAME if self._due else TEXELS_PER_FRAME
        rows = height if whole else max(1, min(height, texels // self.size[0]))
        first = self._next_row if rows < height else 0
        rows = min(rows, height - first)
        end = first + rows
        if end > self._sourced_rows:
            self._find_rows(self._sourced_rows, end)
        self._next_row = end % height
        self._due = max(self._due - rows, 0)
        self.ready = self.ready or not self._due
        return first, rows

    def _find_rows(self, first: int, end: int) -> None:
        """The sources of these rows of display texels."""
        self._find_sources.draw(
            self._source_target,
            uniforms={"u_pages": self._pages},
            viewport=(0, first, self.size[0], end - first),
            textures=self._source_tables,
        )
        self._sourced_rows = end

    def _pass(self, name: str, layer: Layer, shader: str, rects: bool, **more: bool) -> Pass:
        key = name, layer, shader, rects, *more.values()
        if key not in self._passes:
            own = ("TILE",) if name in ("edges", "seams") else ()
            defines = self._lightmap.defines(*layer.defines, *own) | more
            defines |= {"LINEAR": True} if self._linear else {}
            slots = {"layer": f"render/layers/{layer.shader}.glsl", "curve": f"render/{shader}.glsl"}
            vertex = "common/rects" if rects else FULLSCREEN
            self._passes[key] = Pass(
                self._gpu, f"render/{name}", defines=defines, slots=slots, label=name, vertex=vertex
            )
        return self._passes[key]

    def _chart_table(self) -> Texture:
        """The chart of each facet (from 1), R32UI, TABLE_WIDTH wide."""
        charts = self._lightmap.charts
        rows = -(-(charts.facet_count + 1) // TABLE_WIDTH)
        chart_of_facet = np.zeros(rows * TABLE_WIDTH, np.uint32)
        chart_of_facet[charts.face_facet + 1] = charts.face_chart
        return self._gpu.texture((TABLE_WIDTH, rows), 1, "u4", chart_of_facet.tobytes())

    def _write_places(self) -> None:
        """For each slot, from 1, the display texel of a place uv [texels of level 0]: z·uv + (x, y), z 0 where no leaf is; and
        when its leaf was split off, see LeafAges. RGBA32F, PLACES_WIDTH wide."""
        pool, table = self._lightmap.pool, self._tables["t_places"]
        leaves, slot = pool.leaves, np.arange(pool.tiles)
        bordered = pool.tile + 2 * self._border
        places = np.zeros((table.width * table.height, 4), np.float32)
        mine = places[1 : 1 + pool.tiles]
        mine[:, 0] = slot % pool.columns * bordered + self._border - leaves.x * pool.tile
        mine[:, 1] = slot // pool.columns * bordered + self._border - leaves.y * pool.tile
        mine[:, 2] = np.where(pool.used, 2.0**leaves.level, 0.0)
        mine[:, 3] = self._ages.born(pool)
        table.write(places.tobytes())


def display_size(lightmap: Lightmap, border: int) -> tuple[int, int]:
    """Display texels of the whole tile pool."""
    bordered = lightmap.pool.tile + 2 * border
    return lightmap.columns * bordered, lightmap.rows * bordered


def declared(program: Pass, offered: dict[str, T]) -> dict[str, T]:
    """Those of the offered that a program made of slots declares: what it lacks is its slot's choice."""
    names = set(program.program)
    return {name: value for name, value in offered.items() if name in names}
