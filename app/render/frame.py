"""The whole picture, top to bottom: background, surfaces, and onto the screen."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from typing import TypedDict, Unpack

import numpy as np

from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.render.atlas_image import AtlasImage
from app.render.background import Background
from app.render.camera import CameraView
from app.render.false_colour import LAYER, Scale, false_colour_scale, measured
from app.render.flat import FlatMesh, FlatScene
from app.render.mean_picture import MeanPicture
from app.render.options import DisplayOptions
from app.render.pick import Picker, PickHit
from app.render.ray_picture import RayPicture
from app.render.resolve import Reference
from app.render.surfaces import Rect, Surfaces
from app.scene.model import F64, Scene

GL_DEPTH_CLAMP = 0x864F  # OpenGL 3.2: what lies before the near plane is drawn at it instead of being cut away


class Look(TypedDict, total=False):
    """How a picture is drawn. scale: of the false colour; left out, it is found from the light, which waits for the GPU.
    samples: pictures, each a part of a pixel aside, that it is the mean of, 1 unless told otherwise: smooth edges. add: to those
    of the last picture, which was of the same. whole: show all light as it is now, as it is unless told otherwise; False bounds
    the work of a frame, a large lightmap is then brought up to date over several."""

    scale: Scale | None
    samples: int
    add: bool
    whole: bool


class FrameRenderer:
    """Draws frames of one lightmap after another, and answers what lies under a pixel of the last one.

    Keeps its targets between frames of one size. Whoever makes it releases it.
    """

    def __init__(self, gpu: Gpu, *, linear: bool = False) -> None:
        """linear: pictures are of radiance [W/(sr m²)], in targets of floats, not of what a screen shows."""
        self._gpu, self._linear = gpu, linear
        self._background = Background(gpu, linear=linear)
        self._picker = Picker(gpu)
        self._atlas = AtlasImage(gpu)
        self._mean = MeanPicture(gpu, linear=linear)
        self._copy = Pass(gpu, "common/copy", label="present")
        self._surfaces: Surfaces | None = None
        self._prepared: Surfaces | None = None
        self._picture: _Picture | None = None
        self._asked: Scene | None = None  # of the last picture of light
        self._dark = False  # whether nothing in it emits any
        self._flat: FlatMesh | None = None  # of its triangles, once it has been dark
        self._last: tuple[Lightmap, CameraView, tuple[int, int]] | None = None

    def prepare(self, lightmap: Lightmap, interpolation: str) -> None:
        """Make what it takes to draw a lightmap, ahead of its first frame; ``give_up`` where that will not come."""
        self.give_up()
        self._prepared = Surfaces(self._gpu, lightmap, interpolation, linear=self._linear)

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
        **look: Unpack[Look],
    ) -> bool:
        """Draw into the lower left ``size`` (width, height) [px] of ``target``. False where nothing is drawn: not all of the
        layer that is asked for is there yet, and what was drawn last stays.

        reference: for ``display.show`` and for layers that compare; None where there is none. offered: what layers need that a
        solver must offer, see app/render/layers.py.
        shooter: the patch to mark for ``display.last_shooter``: (u, v, u, v) in atlas texels. rays: to draw. Raises GpuError for
        a picture larger than a texture can be.
        """
        kind = measured(display)
        layer = LAYER.get(kind, display.layer)
        scale, samples, add = look.get("scale"), look.get("samples", 1), look.get("add", False)
        whole = look.get("whole", True)
        if kind == "off" or self._linear:
            scale = None
        elif scale is None:
            scale = false_colour_scale(display, lightmap, offered, whole=whole)
        surfaces = self._surfaces_of(lightmap, display.interpolation)
        if not add:
            self._mean.clear()
        if not self._mean.count and not surfaces.resolve(
            layer,
            display,
            size,
            scale=scale,
            reference=reference,
            offered=offered,
            whole=whole,
        ):
            return False
        sky = lightmap.scene.sky if layer == "combined" else None
        unlit = self._unlit(lightmap.scene) if display.plain and not self._linear else None

        def draw(picture: _Picture, aside_px: F64) -> None:
            aside = np.eye(4)
            aside[:2, 3] = 2.0 * aside_px / size
            clip_from_local = aside @ view.clip_from_local(size[0] / size[1], lightmap.space)
            picture.target.clear(depth=1.0)
            with self._depth_clamp():
                if unlit is not None:
                    unlit.draw(picture.target, clip_from_local, view.eye)
                else:
                    surfaces.draw(picture.target, clip_from_local, layer, display, shooter=shooter)
            self._background.draw(picture.target, view, size[0] / size[1], sky, display, scale, aside_px)
            if unlit is None:
                with self._depth_clamp():
                    surfaces.draw_blended(picture.target)
            if rays is not None:
                rays.draw(picture.target, clip_from_local, size, display, linear=self._linear)

        alone = samples == 1 and not add
        picture = self._picture_for(target, size, direct=alone)
        if alone:
            draw(picture, np.zeros(2))
            self._show_own(picture, target, size)
        else:
            for _ in range(samples):
                draw(picture, self._mean.aside_px)
                self._mean.add(picture.colour)
            self._mean.show(target)
        self._last = lightmap, view.copy(), size
        return True

    def _unlit(self, scene: Scene) -> FlatMesh | None:
        """What is drawn of a scene in which nothing emits light, where all would be black; None of others."""
        if scene is not self._asked:
            self._asked, self._dark = scene, not scene.emits
            if self._flat is not None and not self._flat.scene.same_triangles(scene):
                self._flat.release()
                self._flat = None
            if self._dark and self._flat is None:
                self._flat = FlatMesh(self._gpu, FlatScene.of(scene))
            elif self._dark and self._flat is not None:
                self._flat.paint(scene.materials)
        return self._flat if self._dark else None

    @contextlib.contextmanager
    def _depth_clamp(self) -> Iterator[None]:
        self._gpu.ctx.enable_direct(GL_DEPTH_CLAMP)
        try:
            yield
        finally:
            self._gpu.ctx.disable_direct(GL_DEPTH_CLAMP)

    def forget_samples(self) -> None:
        """A picture that is added is the first of its mean."""
        self._mean.clear()

    @property
    def samples(self) -> int:
        """Pictures that the last one is the mean of; 0 where it was drawn alone."""
        return self._mean.count

    def render_flat(self, target: Framebuffer, size: tuple[int, int], mesh: FlatMesh, display: DisplayOptions) -> None:
        """Draw a scene that has no light yet into the lower left ``size`` (width, height) [px] of ``target``."""
        picture, aspect = self._picture_for(target, size, direct=True), size[0] / size[1]
        picture.target.clear(depth=1.0)
        with self._depth_clamp():
            mesh.draw(picture.target, mesh.view.clip_from_local(aspect, mesh.scene.space), mesh.view.eye)
        self._background.draw(picture.target, mesh.view, aspect, None, display, None, np.zeros(2))
        self._show_own(picture, target, size)

    def atlas(self, lightmap: Lightmap, size: tuple[int, int], *, turned: bool) -> Texture | None:
        """The virtual atlas with what the last frame showed, see AtlasImage; None before the first frame of that lightmap."""
        if self._surfaces is None or self._surfaces.lightmap is not lightmap:
            return None
        if not self._surfaces.ready:
            return self._atlas.image
        return self._atlas.draw(self._surfaces, size, turned=turned)

    @property
    def shown(self) -> Lightmap | None:
        """Of what the last frame was."""
        return None if self._last is None else self._last[0]

    def pick(self, x_px: float, y_px: float) -> PickHit | None:
        """The surface under a pixel of the last frame, counted from its top left corner; None for the background."""
        if self._last is None:
            return None
        lightmap, view, size = self._last
        assert self._surfaces is not None
        extent = 2.0 / np.array(size, np.float64)
        centre = ((np.floor([x_px, y_px]) + 0.5) * extent - 1.0) * [1.0, -1.0]
        with self._depth_clamp():
            clip_from_local = view.clip_from_local(size[0] / size[1], lightmap.space)
            return self._picker.pick(self._surfaces, clip_from_local, centre, extent)

    def release(self) -> None:
        self.give_up()
        for resource in (
            self._surfaces,
            self._picture,
            self._flat,
            self._picker,
            self._atlas,
            self._background,
            self._mean,
        ):
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

    def _show_own(self, picture: _Picture, target: Framebuffer, size: tuple[int, int]) -> None:
        if picture.own:
            textures, uniforms = {"t_source": picture.colour}, {"u_offset_px": (0, 0)}
            self._copy.draw(target, textures=textures, uniforms=uniforms, viewport=(0, 0, *size))

    def _picture_for(self, target: Framebuffer, size: tuple[int, int], *, direct: bool) -> _Picture:
        """Where to draw: if ``direct``, straight into a target that is a texture of this size; else into a picture of our own."""
        attached = (target.color_attachments or (None,))[0] if direct else None
        theirs = attached if isinstance(attached, Texture) and attached.size == size else None
        known = self._picture
        if known is None or known.size != size or (not known.own if theirs is None else known.colour is not theirs):
            if known:
                known.release()
            self._picture = known = _Picture(self._gpu, size, theirs, "f4" if self._linear else "f1")
        return known


class _Picture:
    """A picture with depth, as the screen has it or of floats: of our own, or a colour texture of somebody else's that is given
    depth."""

    def __init__(self, gpu: Gpu, size: tuple[int, int], colour: Texture | None, dtype: str) -> None:
        self._gpu, self.size, self.own = gpu, size, colour is None
        self.colour = colour or gpu.texture(size, 4, dtype)
        self.depth: Texture = gpu.depth_texture(size)
        self.target = gpu.target(self.colour, depth=self.depth)

    def release(self) -> None:
        self._gpu.release_all(self.target, self.depth, *([self.colour] if self.own else []))
