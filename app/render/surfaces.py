"""The surfaces of a lightmap, drawn with one of its layers."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.render.ages import LATER, LeafAges
from app.render.false_colour import Scale
from app.render.layers import LAYER_SHADERS
from app.render.options import DisplayOptions
from app.render.resolve import BORDER, PLACES_WIDTH, DisplayTexels, Reference, declared
from app.render.surface_mesh import SurfaceMesh
from app.render.textured_mesh import TexturedMesh, textured_materials
from app.render.tone_mapping import curve
from app.scene.model import F64

Rect = tuple[float, float, float, float]
Part = tuple[int, int, int, int] | None
SHARP = ("combined", "albedo")  # layers of what textures multiply
NOWHERE: Rect = (-1e6, -1e6, -1e6, -1e6)


@dataclass(frozen=True, eq=False)
class Shown:
    """What one part of a picture shows: the textures of its display texels, and of the light on textured materials."""

    textures: dict[str, Texture]
    light: dict[str, Texture] | None
    part: Part


class Surfaces:
    """Draws one lightmap. linear: as light, not developed for the screen. Whoever makes it releases it.

    ready: whether all of the layer that was asked for last is there.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, interpolation: str, *, linear: bool = False) -> None:
        self._gpu, self.lightmap, self._linear = gpu, lightmap, linear
        self._ages = LeafAges(lightmap.pool)
        self.mesh = SurfaceMesh(gpu, lightmap.pool)
        self._texels: dict[tuple[bool, bool], DisplayTexels] = {}  # of a reference; of the light on textured materials
        self._texels[False, False] = DisplayTexels(gpu, lightmap, self._ages, BORDER[interpolation], linear=linear)
        textured = textured_materials(lightmap.scene)
        self._textured = TexturedMesh(gpu, lightmap.pool, textured) if textured else None
        self._textured_passes: dict[tuple[object, ...], Pass] = {}
        self._passes = {(overlay, False, False): self._pass(overlay, bicubic=False) for overlay in (False, True)}
        self._blend: Callable[[Framebuffer], None] | None = None
        self._shown: list[Shown] = []
        self._live = self.ready = False

    def resolve(
        self,
        layer_name: str,
        display: DisplayOptions,
        size: tuple[int, int],
        *,
        scale: Scale | None = None,
        reference: Reference | None = None,
        offered: Mapping[str, Texture] | None = None,
        whole: bool = True,
    ) -> bool:
        """Bring what ``draw`` shows up to date, for a picture of that size [px]. Whether it is all of this layer; else the last
        picture is kept.

        scale: of the false colour, where one is on. reference: for layers that compare, and to be shown as ``display.show`` asks,
        where the layer is of received light. offered: what a solver knows of every texel, for layers that need it. whole: see
        ``DisplayTexels.resolve``; else one of many, in which new leaves shine.
        """
        self._live = not whole
        self._scale = scale
        if LAYER_SHADERS[layer_name].light is not None:
            self.lightmap.refresh_ambient(whole=whole)
        wanted: dict[str, Any] = {"scale": scale, "reference": reference, "offered": offered}
        lit = self._textured is not None and layer_name in SHARP and LAYER_SHADERS[layer_name].light is not None
        left, right = _parts(layer_name, display, reference, size)
        shown, used = [], set()
        for part, instead in ((right, True), (left, False)):
            if part is None or (instead and reference is None):
                continue
            resolved: list[dict[str, Texture]] = []
            for light, layer in ((False, layer_name), (True, "irradiance"))[: 1 + lit]:
                texels, fresh = self._fitting((instead, light), display)
                resolved.append(texels.resolve(layer, display, whole=whole or fresh, instead=instead, **wanted))
                used.add((instead, light))
            shown.append(Shown(resolved[0], resolved[1] if lit else None, part))
        self._forget(used, keep=reference is not None)
        self.ready = all(self._texels[kind].ready for kind in used)
        self._shown = shown
        return self.ready

    def _forget(self, used: Collection[tuple[bool, bool]], *, keep: bool) -> None:
        """Those that are not shown now; with no reference, not those of one either."""
        for kind, texels in list(self._texels.items()):
            if kind[0] and not keep:
                self._texels.pop(kind).release()
            elif kind not in used:
                texels.forget()

    def draw(
        self,
        target: Framebuffer,
        clip_from_local: F64,
        layer_name: str,
        display: DisplayOptions,
        *,
        shooter: Rect | None = None,
    ) -> None:
        """Draw the layer as it was resolved last into ``target``, which has depth, over what is there. shooter: the patch to
        mark: lower and upper corner (u, v, u, v) in atlas texels."""
        uniforms: dict[str, object] = {"u_clip_from_local": uniform_matrix(clip_from_local), "u_texel": self._texel}
        marked = shooter if shooter and display.last_shooter else None
        layer = LAYER_SHADERS[layer_name]
        overlay = display.grid or layer.checker > 0 or marked is not None
        if overlay:
            uniforms |= {"u_grid": float(display.grid), "u_checker": layer.checker, "u_shooter": marked or NOWHERE}
            uniforms |= self._of_leaves
        bicubic = layer.smooth and display.interpolation == "bicubic"
        program, mesh = self._pass_of(overlay, bicubic), self.mesh.seen(clip_from_local)
        for one in self._shown:
            program.draw(target, textures=one.textures, uniforms=uniforms, mesh=mesh, depth=True, scissor=one.part)
        sheer = self.mesh.sheer
        if sheer is not None:
            program, cut_by = self._pass_of(overlay, bicubic, sheer=True), sheer.textures
            if sheer.cut_out is not None:
                for one in self._shown:
                    bound = one.textures | cut_by
                    program.draw(
                        target, textures=bound, uniforms=uniforms, mesh=sheer.cut_out, depth=True, scissor=one.part
                    )
        if self._textured is not None and layer_name in SHARP:
            for one in self._shown:
                self._draw_textured(target, layer_name, display, uniforms, one, overlay=overlay)
        if sheer is None:
            return

        def blend(target: Framebuffer) -> None:
            mesh = sheer.from_far_to_near(clip_from_local)
            if mesh is None:
                return
            target.depth_mask = False
            for one in self._shown:
                program.draw(
                    target,
                    textures=one.textures | cut_by,
                    uniforms=uniforms,
                    mesh=mesh,
                    depth=True,
                    scissor=one.part,
                    blend="over",
                )
            target.depth_mask = True

        self._blend = blend

    def _draw_textured(
        self,
        target: Framebuffer,
        layer_name: str,
        display: DisplayOptions,
        uniforms: Mapping[str, object],
        one: Shown,
        *,
        overlay: bool,
    ) -> None:
        """Materials with textures over what was drawn of them."""
        assert self._textured is not None
        lit, bicubic = LAYER_SHADERS[layer_name].light is not None, display.interpolation == "bicubic"
        shader, developed = curve(display, self._scale, exposed=lit)
        textures = one.textures if one.light is None else one.light
        key = shader, overlay, bicubic, lit
        if key not in self._textured_passes:
            defines = {"OVERLAY": overlay, "BICUBIC": bicubic, "LIT": lit, "PLACES_WIDTH": PLACES_WIDTH}
            slots = {"curve": f"render/{shader}.glsl"}
            self._textured_passes[key] = Pass(
                self._gpu,
                "render/textured",
                defines=defines | {"LINEAR": self._linear},
                slots=slots,
                label="surfaces",
            )
        program, gain = self._textured_passes[key], developed["u_gain"]
        self._gpu.ctx.depth_func = "=="  # where something is cut out, not over what is seen through it
        for number, mesh, pictures in self._textured.batches:
            material = self.lightmap.scene.materials[number]
            own = {"u_albedo": material.albedo, "u_emission": tuple(gain * c for c in material.emission)}
            program.draw(
                target,
                textures=declared(program, textures | pictures),
                uniforms=declared(program, {**uniforms, **developed, **own}),
                mesh=mesh,
                depth=True,
                scissor=one.part,
            )
        self._gpu.ctx.depth_func = "<"

    def draw_blended(self, target: Framebuffer) -> None:
        """Those that are blended with what lies behind them, as ``draw`` drew the others, when all that is there."""
        if self._blend is not None:
            self._blend(target)

    def _fitting(self, kind: tuple[bool, bool], display: DisplayOptions) -> tuple[DisplayTexels, bool]:
        """Those of this kind, of the size that is wanted; and whether they are new: a part of them would be black."""
        border, known = BORDER[display.interpolation], self._texels.get(kind)
        if known is not None and known.fits(border):
            return known, False
        if known is not None:
            known.release()
        linear = self._linear or kind[1]
        self._texels[kind] = made = DisplayTexels(self._gpu, self.lightmap, self._ages, border, linear=linear)
        return made, True

    def draw_atlas(self, program: Pass, target: Framebuffer, *, turned: bool) -> None:
        """The virtual atlas with what was drawn last, all over ``target``; ``program`` is render/atlas. turned: u for v."""
        pool, size = self.lightmap.pool, target.size[::-1] if turned else target.size
        uniforms: dict[str, object] = {
            "u_texel": self._texel,
            "u_atlas_per_px": tuple(a / b for a, b in zip(pool.charts.size, size, strict=True)),
            "u_turned": float(turned),
        }
        program.draw(
            target,
            textures={n: self._shown[-1].textures[n] for n in ("t_display", "t_shown_pages", "t_places")},
            uniforms=uniforms | self._of_leaves,
        )

    @property
    def _of_leaves(self) -> dict[str, object]:
        """What overlays show leaves by. In a picture that stands for itself none is new, whenever the last one was drawn."""
        pool, now = self.lightmap.pool, self._ages.now if self._live else LATER
        return {"u_leaves": float(pool.adaptive), "u_tile": float(pool.tile), "u_now": now}

    @property
    def _texel(self) -> tuple[float, float, float]:
        """Size of a display texel as the sampler counts, and pages per texel of level 0."""
        textures = self._shown[-1].textures
        width, height = textures["t_display"].size
        return 1.0 / width, 1.0 / height, textures["t_shown_pages"].width / self.lightmap.charts.size[0]

    def _pass_of(self, overlay: bool, bicubic: bool, sheer: bool = False) -> Pass:
        kind = overlay, bicubic, sheer
        if kind not in self._passes:
            self._passes[kind] = self._pass(*kind)
        return self._passes[kind]

    def _pass(self, overlay: bool, bicubic: bool, sheer: bool = False) -> Pass:
        defines = {"OVERLAY": overlay, "BICUBIC": bicubic, "PLACES_WIDTH": PLACES_WIDTH} | (
            {"OPACITY": True} if sheer else {}
        )
        return Pass(self._gpu, "render/surfaces", defines=defines, label="surfaces")

    def release(self) -> None:
        for texels in self._texels.values():
            texels.release()
        if self._textured is not None:
            self._textured.release()
        self.mesh.release()


def _parts(
    layer_name: str, display: DisplayOptions, reference: Reference | None, size: tuple[int, int]
) -> tuple[Part, Part]:
    """The part of the picture (x, y, width, height) [px] that shows the solution, and the one that shows the reference; None for
    one that is not shown."""
    width, height = size
    share = 1.0
    if reference is not None and LAYER_SHADERS[layer_name].received:
        share = {"solution": 1.0, "reference": 0.0, "split": display.split}[display.show]
    middle = round(share * width)
    left, right = (0, 0, middle, height), (middle, 0, width - middle, height)
    return left if middle > 0 else None, right if middle < width else None


def uniform_matrix(matrix: F64) -> tuple[float, ...]:
    """(4, 4) for column vectors as GL's 16 column-major floats."""
    return tuple(matrix.T.ravel().tolist())
