"""The surfaces of a lightmap, drawn with one of its layers."""

from __future__ import annotations

from app.atlas.lightmap import Lightmap
from app.gpu import Framebuffer, Gpu, Pass
from app.render.false_colour import Scale
from app.render.layers import LAYER_SHADERS
from app.render.options import DisplayOptions
from app.render.resolve import DisplayTexels
from app.scene.model import F64, RGB

Rect = tuple[float, float, float, float]
NOWHERE: Rect = (-1e6, -1e6, -1e6, -1e6)
DARK: RGB = (0.0, 0.0, 0.0)


class Surfaces:
    """Draws one lightmap. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap) -> None:
        self._gpu, self.lightmap = gpu, lightmap
        self._texels = DisplayTexels(gpu, lightmap)
        self._passes = {
            overlay: Pass(gpu, "render/surfaces", defines={"OVERLAY": overlay}, label="surfaces")
            for overlay in (False, True)
        }

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
        ``DisplayTexels.resolve``.
        """
        lit_by = ambient if ambient and display.ambient else DARK
        if not self._texels.fits:
            self._texels.release()
            self._texels = DisplayTexels(self._gpu, self.lightmap)
        textures = self._texels.resolve(layer_name, display, scale=scale, ambient=lit_by, whole=whole)

        width, height = self._texels.size
        uniforms: dict[str, object] = {
            "u_clip_from_local": uniform_matrix(clip_from_local),
            "u_texel": (1.0 / width, 1.0 / height, self.lightmap.nodes.pages_per_texel),
        }
        marked = shooter if shooter and display.last_shooter else None
        checker = LAYER_SHADERS[layer_name].checker
        overlay = display.grid or checker > 0 or marked is not None
        if overlay:
            uniforms |= {"u_grid": float(display.grid), "u_checker": checker, "u_shooter": marked or NOWHERE}
            nodes = self.lightmap.nodes
            uniforms |= {"u_leaves": float(nodes.depth > 0), "u_tile": float(nodes.tile)}
        self._passes[overlay].draw(target, textures=textures, uniforms=uniforms, mesh=self.lightmap.mesh, depth=True)

    def release(self) -> None:
        self._texels.release()


def uniform_matrix(matrix: F64) -> tuple[float, ...]:
    """(4, 4) for column vectors as GL's 16 column-major floats."""
    return tuple(matrix.T.ravel().tolist())
