"""What is seen of a scene that is open: pictures, what lies under a pixel, the atlas, and the map of the last shooter."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from app.gpu import Framebuffer, Gpu, Texture
from app.lightmap.lightmap import Lightmap
from app.render.camera import CameraView
from app.render.exposure import exposure_of
from app.render.false_colour import Scale
from app.render.frame import FrameRenderer
from app.render.options import DisplayOptions
from app.render.resolve import Reference
from app.render.surfaces import Rect
from app.scene.model import Camera
from app.session.picking import Picked, picked_from_hit
from app.solvers import EnergyBalance, ShootingOptions, Solver
from app.visibility.item_image import ItemImage
from app.visibility.projections import PROJECTIONS


class Viewing(ABC):
    """Whoever opens scenes is one, sets these, and releases what was drawn with."""

    lightmap: Lightmap
    solver: Solver[ShootingOptions]
    shooting: ShootingOptions
    view: CameraView

    def __init__(self, gpu: Gpu, display: DisplayOptions) -> None:
        self.gpu, self.display = gpu, display
        self.renderer = FrameRenderer(gpu)
        self.items = ItemImage(gpu)

    @property
    @abstractmethod
    def books(self) -> EnergyBalance:
        """The last energy book that was made."""

    @property
    def shown(self) -> DisplayOptions:
        """The display knobs, as far as there is what they ask for."""
        return self.display

    def _reference(self, *, whole: bool) -> Reference | None:
        """The light that is shown beside or instead of the solution's, and errors are of."""
        return None

    def pick(self, x_px: int, y_px: int) -> Picked | None:
        """What surface is at that pixel of the last frame, and the light on it."""
        hit = self.renderer.pick(x_px, y_px)
        return None if hit is None else picked_from_hit(self.lightmap, hit, self.solver.patch_edge)

    def look_through(self, camera: Camera) -> None:
        """Stand where a camera of the scene stands; orbit around the scene's middle from there."""
        distance = float(np.linalg.norm(np.asarray(camera.world_from_camera)[:3, 3] - self.lightmap.space.centre))
        self.view = CameraView.from_camera(camera, distance)

    def draw(
        self,
        target: Framebuffer,
        size: tuple[int, int],
        *,
        scale: Scale | None = None,
        samples: int = 1,
        whole: bool = True,
    ) -> None:
        """The picture of the solution as it is now; if not ``whole``, brought up to date over several frames."""
        self.renderer.render(
            target,
            size,
            self.lightmap,
            self.view,
            self.shown,
            reference=self._reference(whole=whole),
            shooter=self._shooter_rect,
            scale=scale,
            samples=samples,
            whole=whole,
        )

    def expose(self) -> None:
        """Set the exposure from the light of the scene."""
        mean_residual = self.books.unshot / max(self.books.area, 1e-300)
        self.display = self.display.replace(exposure=exposure_of(self.lightmap, mean_residual))

    @property
    def _shooter_rect(self) -> Rect | None:
        """The last shooter's patch in atlas texels."""
        shot = self.solver.last_shot
        return shot.rect if shot and self.display.last_shooter else None

    def atlas_image(self, size: tuple[int, int], *, turned: bool = False) -> Texture | None:
        """The virtual atlas with what was drawn last, v up or to the right; None before the first picture."""
        return self.renderer.atlas(self.lightmap, size, turned=turned)

    def vanished(self) -> int:
        """Triangles that lie between the samples of the last shooter's map."""
        return self.solver.vanished()

    def hemicube_image(self) -> Texture:
        """The last shooter's visibility map, in one colour per facet."""
        seen, projection = self.solver.inspect(), PROJECTIONS[self.shooting.projection]
        return self.items.draw(seen["items"], seen["depth"], projection.size(self.solver.resolution))

    def release(self) -> None:
        self.renderer.release()
        self.items.release()
