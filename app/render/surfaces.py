"""The surfaces of a lightmap, drawn with one of its layers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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


class Surfaces:
    """Draws one lightmap. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, interpolation: str) -> None:
        self._gpu, self.lightmap = gpu, lightmap
        self._ages = LeafAges(lightmap.pool)
        self.mesh = SurfaceMesh(gpu, lightmap.pool)
        self._texels = DisplayTexels(gpu, lightmap, self._ages, BORDER[interpolation])
        self._others: DisplayTexels | None = None  # of a reference's light
        textured = textured_materials(lightmap.scene)
        self._textured = TexturedMesh(gpu, lightmap.pool, textured) if textured else None
        self._light: dict[bool, DisplayTexels] = {}  # that falls on them, and that of a reference
        self._textured_passes: dict[tuple[object, ...], Pass] = {}
        self._sides = True, False  # whether the solution and the reference were shown last
        self._passes = {(overlay, False, False): self._pass(overlay, bicubic=False) for overlay in (False, True)}
        self._blend: Callable[[Framebuffer], None] | None = None
        self._shown: dict[str, Texture] = {}
        self._live = False

    def draw(
        self,
        target: Framebuffer,
        clip_from_local: F64,
        layer_name: str,
        display: DisplayOptions,
        *,
        scale: Scale | None = None,
        reference: Reference | None = None,
        offered: Mapping[str, Texture] | None = None,
        shooter: Rect | None = None,
        whole: bool = True,
    ) -> None:
        """Draw the layer into ``target``, which has depth, over what is there.

        scale: of the false colour, where one is on. reference: for layers that compare, and to be shown as ``display.show`` asks,
        where the layer is of received light. offered: what a solver knows of every texel, for layers that need it. shooter: the
        patch to mark: lower and upper corner (u, v, u, v) in atlas texels.
        whole: see ``DisplayTexels.resolve``; else one of many, in which new leaves shine.
        """
        self._live = not whole
        wanted: dict[str, Any] = {"scale": scale, "reference": reference, "offered": offered}
        shown: list[tuple[dict[str, Texture], Part]] = []
        left, right = _parts(layer_name, display, reference, target.size)
        if right is not None and reference is not None:
            self._others, fresh = self._fitting(self._others, display)
            now = whole or fresh or not self._sides[1]
            shown.append((self._others.resolve(layer_name, display, whole=now, instead=True, **wanted), right))
        elif reference is None and self._others is not None:
            self._others.release()
            self._others = None
            if True in self._light:
                self._light.pop(True).release()
        if left is not None:
            self._texels, fresh = self._fitting(self._texels, display)
            now = whole or fresh or not self._sides[0]
            shown.append((self._texels.resolve(layer_name, display, whole=now, **wanted), left))
        self._shown, self._sides = shown[-1][0], (left is not None, right is not None)

        uniforms: dict[str, object] = {"u_clip_from_local": uniform_matrix(clip_from_local), "u_texel": self._texel}
        marked = shooter if shooter and display.last_shooter else None
        layer = LAYER_SHADERS[layer_name]
        overlay = display.grid or layer.checker > 0 or marked is not None
        if overlay:
            uniforms |= {"u_grid": float(display.grid), "u_checker": layer.checker, "u_shooter": marked or NOWHERE}
            uniforms |= self._of_leaves
        bicubic = layer.smooth and display.interpolation == "bicubic"
        program, mesh = self._pass_of(overlay, bicubic), self.mesh.seen(clip_from_local)
        for textures, part in shown:
            program.draw(target, textures=textures, uniforms=uniforms, mesh=mesh, depth=True, scissor=part)
        sheer = self.mesh.sheer
        if sheer is not None:
            program, cut_by = self._pass_of(overlay, bicubic, sheer=True), sheer.textures
            if sheer.cut_out is not None:
                for textures, part in shown:
                    bound = textures | cut_by
                    program.draw(
                        target, textures=bound, uniforms=uniforms, mesh=sheer.cut_out, depth=True, scissor=part
                    )
        if self._textured is not None and layer_name in SHARP:
            for (_, part), instead in zip(
                shown, [True] * (right is not None) + [False] * (left is not None), strict=True
            ):
                self._draw_textured(
                    target, layer_name, display, uniforms, part, instead, wanted, overlay=overlay, whole=whole
                )
        if sheer is None:
            return

        def blend(target: Framebuffer) -> None:
            mesh = sheer.from_far_to_near(clip_from_local)
            if mesh is None:
                return
            target.depth_mask = False
            for textures, part in shown:
                program.draw(
                    target,
                    textures=textures | cut_by,
                    uniforms=uniforms,
                    mesh=mesh,
                    depth=True,
                    scissor=part,
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
        part: Part,
        instead: bool,
        wanted: Mapping[str, Any],
        *,
        overlay: bool,
        whole: bool,
    ) -> None:
        """Materials with textures over what was drawn of them. instead: by the light of the reference."""
        assert self._textured is not None
        lit, bicubic = LAYER_SHADERS[layer_name].light is not None, display.interpolation == "bicubic"
        shader, developed = curve(display, wanted["scale"], exposed=lit)
        textures = self._shown
        if lit:
            light, fresh = self._fitting(self._light.get(instead), display, linear=True)
            self._light[instead] = light
            textures = light.resolve("irradiance", display, whole=whole or fresh, instead=instead, **wanted)
        key = shader, overlay, bicubic, lit
        if key not in self._textured_passes:
            defines = {"OVERLAY": overlay, "BICUBIC": bicubic, "LIT": lit, "PLACES_WIDTH": PLACES_WIDTH}
            slots = {"curve": f"render/{shader}.glsl"}
            self._textured_passes[key] = Pass(
                self._gpu, "render/textured", defines=defines, slots=slots, label="surfaces"
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
                scissor=part,
            )
        self._gpu.ctx.depth_func = "<"

    def draw_blended(self, target: Framebuffer) -> None:
        """Those that are blended with what lies behind them, as ``draw`` drew the others, when all that is there."""
        if self._blend is not None:
            self._blend(target)

    def _fitting(
        self, texels: DisplayTexels | None, display: DisplayOptions, *, linear: bool = False
    ) -> tuple[DisplayTexels, bool]:
        """These, or others of the size that is wanted; and whether they are new: a part of them would be black."""
        border = BORDER[display.interpolation]
        if texels is not None and texels.fits(border):
            return texels, False
        if texels is not None:
            texels.release()
        return DisplayTexels(self._gpu, self.lightmap, self._ages, border, linear=linear), True

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
            textures={n: self._shown[n] for n in ("t_display", "t_shown_pages", "t_places")},
            uniforms=uniforms | self._of_leaves,
        )

    @property
    def drawn(self) -> bool:
        """Whether there is something to be seen in an atlas."""
        return bool(self._shown)

    @property
    def _of_leaves(self) -> dict[str, object]:
        """What overlays show leaves by. In a picture that stands for itself none is new, whenever the last one was drawn."""
        pool, now = self.lightmap.pool, self._ages.now if self._live else LATER
        return {"u_leaves": float(pool.adaptive), "u_tile": float(pool.tile), "u_now": now}

    @property
    def _texel(self) -> tuple[float, float, float]:
        """Size of a display texel as the sampler counts, and pages per texel of level 0."""
        width, height = self._texels.size
        return 1.0 / width, 1.0 / height, self._shown["t_shown_pages"].width / self.lightmap.charts.size[0]

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
        self._texels.release()
        if self._others is not None:
            self._others.release()
        for light in self._light.values():
            light.release()
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
