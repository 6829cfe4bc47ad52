"""The surfaces of a lightmap, drawn with one of its layers."""

from __future__ import annotations

from app.atlas.lightmap import Lightmap
from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.render.ages import LATER, LeafAges
from app.render.false_colour import Scale
from app.render.layers import LAYER_SHADERS
from app.render.options import DisplayOptions
from app.render.resolve import BORDER, PLACES_WIDTH, DisplayTexels
from app.render.surface_mesh import SurfaceMesh
from app.scene.model import F64, RGB

Rect = tuple[float, float, float, float]
NOWHERE: Rect = (-1e6, -1e6, -1e6, -1e6)
DARK: RGB = (0.0, 0.0, 0.0)


class Surfaces:
    """Draws one lightmap. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, interpolation: str) -> None:
        self._gpu, self.lightmap = gpu, lightmap
        self._ages = LeafAges(lightmap.nodes)
        self.mesh = SurfaceMesh(gpu, lightmap.nodes)
        self._texels = DisplayTexels(gpu, lightmap, self._ages, BORDER[interpolation])
        self._passes = {(overlay, False): self._pass(overlay, bicubic=False) for overlay in (False, True)}
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
        ambient: RGB | None = None,
        shooter: Rect | None = None,
        whole: bool = True,
    ) -> None:
        """Draw the layer into ``target``, which has depth, over what is there.

        scale: of the false colour, where one is on. ambient: A [W/m²], light that every surface is taken to receive
        besides. shooter: the patch to mark: lower and upper corner (u, v, u, v) in atlas texels. whole: see
        ``DisplayTexels.resolve``; else one of many, in which new leaves shine.
        """
        lit_by = ambient if ambient and display.ambient else DARK
        border, self._live = BORDER[display.interpolation], not whole
        if not self._texels.fits(border):
            self._texels.release()
            self._texels = DisplayTexels(self._gpu, self.lightmap, self._ages, border)
            whole = True  # a part of new ones would be black
        self._shown = self._texels.resolve(layer_name, display, scale=scale, ambient=lit_by, whole=whole)

        uniforms: dict[str, object] = {"u_clip_from_local": uniform_matrix(clip_from_local), "u_texel": self._texel}
        marked = shooter if shooter and display.last_shooter else None
        layer = LAYER_SHADERS[layer_name]
        overlay = display.grid or layer.checker > 0 or marked is not None
        if overlay:
            uniforms |= {"u_grid": float(display.grid), "u_checker": layer.checker, "u_shooter": marked or NOWHERE}
            uniforms |= self._of_leaves
        kind = overlay, layer.smooth and display.interpolation == "bicubic"
        if kind not in self._passes:
            self._passes[kind] = self._pass(*kind)
        mesh = self.mesh.seen(clip_from_local)
        self._passes[kind].draw(target, textures=self._shown, uniforms=uniforms, mesh=mesh, depth=True)

    def draw_atlas(self, program: Pass, target: Framebuffer, *, turned: bool) -> None:
        """The virtual atlas with what was drawn last, all over ``target``; ``program`` is render/atlas. turned: u for v."""
        nodes, size = self.lightmap.nodes, target.size[::-1] if turned else target.size
        uniforms: dict[str, object] = {
            "u_texel": self._texel,
            "u_atlas_per_px": tuple(a / b for a, b in zip(nodes.charts.size, size, strict=True)),
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
        nodes, now = self.lightmap.nodes, self._ages.now if self._live else LATER
        return {"u_leaves": float(nodes.adaptive), "u_tile": float(nodes.tile), "u_now": now}

    @property
    def _texel(self) -> tuple[float, float, float]:
        """Size of a display texel as the sampler counts, and pages per texel of level 0."""
        width, height = self._texels.size
        return 1.0 / width, 1.0 / height, self._shown["t_shown_pages"].width / self.lightmap.charts.size[0]

    def _pass(self, overlay: bool, bicubic: bool) -> Pass:
        defines = {"OVERLAY": overlay, "BICUBIC": bicubic, "PLACES_WIDTH": PLACES_WIDTH}
        return Pass(self._gpu, "render/surfaces", defines=defines, label="surfaces")

    def release(self) -> None:
        self._texels.release()
        self.mesh.release()


def uniform_matrix(matrix: F64) -> tuple[float, ...]:
    """(4, 4) for column vectors as GL's 16 column-major floats."""
    return tuple(matrix.T.ravel().tolist())
