"""The whole picture, top to bottom: background, surfaces, and onto the screen."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.render.atlas_image import AtlasImage
from app.render.background import Background
from app.render.camera import CameraView
from app.render.false_colour import LAYER, Scale, false_colour_scale, measured
from app.render.options import DisplayOptions
from app.render.pick import Picker, PickHit
from app.render.ray_picture import RayPicture
from app.render.resolve import Reference
from app.render.surfaces import Rect, Surfaces

GL_DEPTH_CLAMP = 0x864F  # OpenGL 3.2: what lies before the near plane is drawn at it instead of being cut away


class FrameRenderer:
    """Draws frames of one lightmap after another, and answers what lies under a pixel of the last one.

    Keeps its targets between frames of one size. Whoever makes it releases it.
    """

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._background = Background(gpu)
        self._picker = Picker(gpu)
        self._atlas = AtlasImage(gpu)
        self._surfaces: Surfaces | None = None
        self._prepared: Surfaces | None = None
        self._picture: _Picture | None = None
        self._last: tuple[Lightmap, CameraView, tuple[int, int]] | None = None

    def prepare(self, lightmap: Lightmap, interpolation: str) -> None:
        """Make what it takes to draw a lightmap, ahead of its first frame; ``give_up`` where that will not come."""
        self.give_up()
        self._prepared = Surfaces(self._gpu, lightmap, interpolation)

    def give_up(self) -> None:
        """Release what was prepared and not drawn yet."""
        if self._prepared is not None:
            self._prepared.release()
            self._prepared = None

    def render(
        self,
        target: Framebuffer,
        size: tuple[int, int],
        lightmap: Lightmap,
        view: CameraView,
        display: DisplayOptions,
        *,
        reference: Reference | None = None,
        offered: Mapping[str, Texture] | None = None,
        shooter: Rect | None = None,
        rays: RayPicture | None = None,
        scale: Scale | None = None,
        samples: int = 1,
        whole: bool = True,
    ) -> None:
        """Draw into the lower left ``size`` (width, height) [px] of ``target``.

        reference: for ``display.show`` and for layers that compare; None where there is none. offered: what layers need that a
        solver must offer, see app/render/layers.py.
        shooter: the patch to mark for ``display.last_shooter``: (u, v, u, v) in atlas texels. rays: to draw. scale: of the
        false colour; left out, it is found from the light, which waits for the GPU.
        samples: per pixel along each axis. whole: show all light as it is now; False bounds the work of a frame, a large
        lightmap is then brought up to date over several. Raises GpuError for a picture larger than a texture can be.
        """
        kind = measured(display)
        layer = LAYER.get(kind, display.layer)
        scale = None if kind == "off" else scale or false_colour_scale(display, lightmap, offered)
        clip_from_local = view.clip_from_local(size[0] / size[1], lightmap.space)
        surfaces = self._surfaces_of(lightmap, display.interpolation)
        picture = self._picture_for(target, size, samples)

        picture.target.clear(depth=1.0)
        self._gpu.ctx.enable_direct(GL_DEPTH_CLAMP)
        surfaces.draw(
            picture.target,
            clip_from_local,
            layer,
            display,
            scale=scale,
            reference=reference,
            offered=offered,
            shooter=shooter,
            whole=whole,
        )
        self._gpu.ctx.disable_direct(GL_DEPTH_CLAMP)
        sky = lightmap.scene.sky if layer == "combined" else None
        self._background.draw(picture.target, view, size[0] / size[1], sky, display, scale)
        self._gpu.ctx.enable_direct(GL_DEPTH_CLAMP)
        surfaces.draw_blended(picture.target)
        self._gpu.ctx.disable_direct(GL_DEPTH_CLAMP)
        if rays is not None:
            rays.draw(picture.target, clip_from_local, picture.size, display, samples)
        if picture.own:
            present = Pass(self._gpu, "render/present", defines={"SAMPLES": samples}, label="present")
            present.draw(target, textures={"t_picture": picture.colour}, viewport=(0, 0, *size))
        self._last = lightmap, view.copy(), size

    def atlas(self, lightmap: Lightmap, size: tuple[int, int], *, turned: bool) -> Texture | None:
        """The virtual atlas with what the last frame showed, see AtlasImage; None before the first frame of that lightmap."""
        if self._surfaces is None or self._surfaces.lightmap is not lightmap or not self._surfaces.drawn:
            return None
        return self._atlas.draw(self._surfaces, size, turned=turned)

    def pick(self, x_px: float, y_px: float) -> PickHit | None:
        """The surface under a pixel of the last frame, counted from its top left corner; None for the background."""
        if self._last is None:
            return None
        lightmap, view, size = self._last
        assert self._surfaces is not None
        extent = 2.0 / np.array(size, np.float64)
        centre = ((np.floor([x_px, y_px]) + 0.5) * extent - 1.0) * [1.0, -1.0]
        self._gpu.ctx.enable_direct(GL_DEPTH_CLAMP)
        hit = self._picker.pick(self._surfaces, view.clip_from_local(size[0] / size[1], lightmap.space), centre, extent)
        self._gpu.ctx.disable_direct(GL_DEPTH_CLAMP)
        return hit

    def release(self) -> None:
        self.give_up()
        for resource in (self._surfaces, self._picture, self._picker, self._atlas, self._background):
            if resource is not None:
                resource.release()

    def _surfaces_of(self, lightmap: Lightmap, interpolation: str) -> Surfaces:
        if self._surfaces is None or self._surfaces.lightmap is not lightmap:
            if self._surfaces:
                self._surfaces.release()
            if self._prepared is None or self._prepared.lightmap is not lightmap:
                self.prepare(lightmap, interpolation)
            self._surfaces, self._prepared = self._prepared, None
            assert self._surfaces is not None
        return self._surfaces

    def _picture_for(self, target: Framebuffer, size: tuple[int, int], samples: int) -> _Picture:
        """Where to draw: straight into a target that is a texture of this size, else into a picture of our own."""
        attached = target.color_attachments or (None,)
        direct = attached[0] if samples == 1 and isinstance(attached[0], Texture) and attached[0].size == size else None
        drawn = size[0] * samples, size[1] * samples
        known = self._picture
        if known is None or known.size != drawn or (not known.own if direct is None else known.colour is not direct):
            if known:
                known.release()
            self._picture = known = _Picture(self._gpu, drawn, direct)
        return known


class _Picture:
    """An sRGB picture with depth: of our own, or a colour texture of somebody else's that is given depth."""

    def __init__(self, gpu: Gpu, size: tuple[int, int], colour: Texture | None) -> None:
        self._gpu, self.size, self.own = gpu, size, colour is None
        self.colour = colour or gpu.texture(size, 4, "f1")
        self.depth: Texture = gpu.depth_texture(size)
        self.target = gpu.target(self.colour, depth=self.depth)

    def release(self) -> None:
        self._gpu.release_all(self.target, self.depth, *([self.colour] if self.own else []))
