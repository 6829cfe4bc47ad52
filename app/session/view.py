"""What is seen of a session: pictures, what lies under a pixel, and the atlas.

A view has a session, never the reverse: a session that bakes or measures has none, and no renderer.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Unpack

import numpy as np

from app.gpu import Framebuffer, Texture
from app.lightmap.lightmap import Lightmap
from app.render.camera import CameraView
from app.render.exposure import TO_COME, exposure_of, first_exposure, is_trapped
from app.render.false_colour import Scale, false_colour_scale
from app.render.flat import FlatMesh
from app.render.frame import FrameRenderer, Look
from app.render.layers import LAYER_SHADERS, SEAMS, layers_with
from app.render.options import DisplayOptions
from app.render.pick import with_texel
from app.render.ray_picture import RayPicture
from app.render.resolve import Reference
from app.render.seam_jumps import SeamJumps
from app.render.seen import Texels, seen_texels
from app.render.surfaces import Rect
from app.scene.model import Camera
from app.session.picking import Picked, picked_from_hit
from app.session.session import Session
from app.session.texel_use import texel_note, texel_use
from app.solvers import HEMISPHERE, Inspection, Rays

SIZE = (1280, 720)  # px, of a picture before the first one
TRAPPED = "the light is trapped: none of it reaches what the camera sees"
BACKS = (
    "all light falls on the backs of surfaces that have one side, and are black there: their fronts face away from it"
)
LOOK_SECONDS = 0.5  # between two looks whether light is trapped: each reads what is seen
RAYS_SECONDS = 0.25  # between two looks at the rays that are drawn, while light moves


class View:
    """A camera in the open scene, how its light is displayed, and the renderer. Whoever makes it releases it, before the session.

    It is made before a scene opens: camera is set then. bookmarks: of cameras, by digit. linear: whether its pictures are of
    radiance. marked: the texel (column, row) of the tile pool whose rays are drawn,
    where the solver has any.
    """

    def __init__(
        self, session: Session, display: DisplayOptions | None = None, *, follows: bool = True, linear: bool = False
    ) -> None:
        """follows: whether it goes along with scenes that open. linear: as of FrameRenderer."""
        self.session, self.display = session, display or DisplayOptions()
        self.camera: CameraView
        self.bookmarks: dict[int, CameraView] = {}
        self.linear = linear
        self.marked: tuple[int, int] | None = None
        self._size = SIZE
        self._looked_at: tuple[object, object] = (None, None)  # light, and from where
        self._look_due = 0.0
        self._flat: FlatMesh | None = None  # of the scene that is loading
        self._flat_drawn: object = None
        self._opened_as: tuple[CameraView, DisplayOptions] | None = None  # until what was opened is drawn
        self._renderer, self._rays = FrameRenderer(session.gpu, linear=linear), RayPicture(session.gpu)
        self._seams = SeamJumps(session.gpu)
        self._texel_note: tuple[object, str | None] = (None, None)  # and of which light
        self._rays_of: object = None
        self._rays_due = 0.0
        if follows:
            session.follow(self._prepare, self._opened)

    def _prepare(self, lightmap: Lightmap) -> Callable[[], None]:
        self._renderer.prepare(lightmap, self.display.interpolation)
        return self._renderer.give_up

    def _opened(self, exposure: float | None, *, same_scene: bool, reference_gone: bool) -> None:
        """Another lightmap is open. exposure: that its light will need [EV], where it is known."""
        shows_it = same_scene or self._flat is not None
        self._drop_flat()
        if not same_scene:
            self.look_through(self.session.scene.cameras[0])
            self.bookmarks = {}
        if exposure is not None:
            self.display = self.display.replace(exposure=exposure)
        if reference_gone:
            self.display = self._without_reference
        self._opened_as = (self.camera, self.display) if shows_it else None

    @property
    def waits_for_light(self) -> bool:
        """Whether what has just been opened has no light yet, and is looked at as then: the picture of it from before, flat or in
        other texels, says more than a black one."""
        session, seen = self.session, self._opened_as
        if seen is None or seen[0] is not self.camera or seen[1] is not self.display:
            return False
        return session.solver.issued == 0 and session.run.running and session.edited_scene.emits

    # -- the camera ----------------------------------------------------------------------------------------------------

    def look_through(self, camera: Camera) -> None:
        """Stand where a camera of the scene stands; orbit around the scene's middle from there."""
        centre = self.session.lightmap.space.centre
        distance = float(np.linalg.norm(np.asarray(camera.world_from_camera)[:3, 3] - centre))
        self.camera = CameraView.from_camera(camera, distance)

    def tell_observer(self) -> None:
        """Let the session know where the eye is now."""
        if self.session.opened:
            self.session.observe(self.camera.eye)

    # -- pictures ------------------------------------------------------------------------------------------------------

    def wait_for_light(self) -> None:
        """Have all of the light that is to be shown, also what frames do without until it is made in the background."""
        if self.session.opened:
            self.session.lightmap.refresh_ambient(wait=True)

    def draw(self, target: Framebuffer, size: tuple[int, int], **look: Unpack[Look]) -> bool:
        """The picture of the solution as it is now; whether it was drawn, see ``FrameRenderer.render``."""
        self._size, whole = size, look.get("whole", True)
        self._opened_as = None  # once it is drawn, it follows all that happens
        return self._renderer.render(
            target,
            size,
            self.session.lightmap,
            self.camera,
            self.shown,
            reference=self._reference(whole=whole),
            offered=self._offered(whole=whole),
            shooter=self._last_shooter,
            rays=self._marked_rays(whole=whole),
            **look,
        )

    def twin(self, *, linear: bool = False) -> View:
        """A view of the same from the same place with a renderer of its own, for as long as this scene is open; whoever asks for
        it releases it. linear: of radiance [W/(sr m²)], neither exposed nor tone-mapped, into targets of floats; of layers that
        are no light, what they show."""
        display = self.shown.replace(exposure=0.0, false_colour="off") if linear else self.display
        twin = View(self.session, display, follows=False, linear=linear)
        twin.camera, twin.marked = self.camera.copy(), self.marked
        return twin

    def forget_samples(self) -> None:
        """A picture that is added is the first."""
        self._renderer.forget_samples()

    @property
    def samples(self) -> int:
        """Pictures that the last one is the mean of."""
        return self._renderer.samples

    @property
    def still(self) -> tuple[object, ...] | None:
        """All that the picture depends on, where it stays as it is by itself; None while light moves. Coarse light moves from one
        piece of work to the next: it is not drawn more often."""
        session = self.session
        if not session.coarse and (session.solving or not session.run.settled):
            return None
        camera = self.camera
        seen = camera.world_from_camera.tobytes(), camera.yfov, self.shown, self.marked
        return session.state, session.compared.comparison, session.gpu.shaders.generation, *seen

    def draw_flat(self, target: Framebuffer, size: tuple[int, int]) -> bool:
        """The scene that is on its way, flat, where nothing is open and it has been read; whether there is one. Drawn once into a
        target."""
        loading = self.session.loading
        flat = None if loading is None or self.session.opened else loading.flat
        if self._flat is not None and self._flat.scene is not flat:
            self._drop_flat()
        if flat is None:
            return False
        if self._flat is None:
            self._flat = FlatMesh(self.session.gpu, flat)
        if self._flat_drawn != (target, size):
            self._renderer.render_flat(target, size, self._flat, self.display)
            self._flat_drawn = target, size
        return True

    def _drop_flat(self) -> None:
        if self._flat is not None:
            self._flat.release()
        self._flat = self._flat_drawn = None

    def false_colour_scale(self) -> Scale:
        """Of what is shown, which is in false colour. Waits for the GPU."""
        return false_colour_scale(self.shown, self.session.lightmap, self._offered(whole=False), whole=False)

    def _offered(self, *, whole: bool) -> Mapping[str, Texture]:
        """What the layer that is shown needs of the solver, or of seams."""
        offered = LAYER_SHADERS[self.shown.layer].offered
        if offered == SEAMS:
            return {SEAMS: self._seams.of(self.session.lightmap, whole=whole)}
        return self.session.solver.layers if offered else {}

    def expose(self, size: tuple[int, int] | None = None) -> None:
        """Set the exposure from the light on what the camera sees in a picture of that size [px], else in one like the last."""
        width, height = size or self._size
        balance = self.session.run.energy
        unshot, emitted = (power / max(balance.area, 1e-300) for power in (balance.unshot, balance.emitted))
        self.display = self.display.replace(
            exposure=exposure_of(self.session.lightmap, self._seen(width / height), unshot, emitted)
        )

    def expose_for_light_to_come(self) -> None:
        """Set the exposure by a forecast of the light that the scene's lamps will give, as they are now."""
        width, height = self._size
        exposure = first_exposure(self.session.lightmap.pool, self._seen(width / height), self.session.edited_scene)
        self.display = self.display.replace(exposure=exposure)

    def look_for_light(self) -> str | None:
        """What to say where all light has been distributed, or all but a hundredth, and none of it is anywhere, or where the
        camera sees anything. Looked up once for a solution, once before it has converged, and for each place of the camera, not
        in every frame while that moves; it becomes the session's message, too."""
        session = self.session
        if not session.opened or not (session.run.converged or self._hardly_any_is_to_come):
            self._say_no_longer()
            self._looked_at = None, None
            return None
        solution = session.solver.issued if session.run.converged else None
        light, place = (session.lightmap, solution), (*self.camera.world_from_camera.flat, self.camera.yfov)
        moving = light == self._looked_at[0] and time.perf_counter() < self._look_due
        if (light, place) == self._looked_at or moving:
            return None
        self._look_due = time.perf_counter() + LOOK_SECONDS
        self._looked_at = light, place
        balance = session.run.energy
        even = float(np.mean(balance.emitted)) / max(balance.area, 1e-300)
        width, height = self._size
        if self._only_backs_are_lit():
            session.message = BACKS
        elif is_trapped(session.lightmap, self._seen(width / height), even):
            session.message = TRAPPED
        else:
            self._say_no_longer()
            return None
        return session.message

    @property
    def _hardly_any_is_to_come(self) -> bool:
        """Whether what is left of the light will not show in a room that is dark by now."""
        return self.session.family.distributes and self.session.run.progress.remaining < TO_COME

    def _only_backs_are_lit(self) -> bool:
        """Whether light is emitted, does not escape, and reaches no texel. Waits for the GPU where no texel reflects."""
        balance = self.session.run.energy
        kept = float(np.sum(balance.emitted)) > 2 * float(np.sum(balance.escaped))
        return kept and not np.any(balance.reflectance) and not self.session.lightmap.irradiance().any()

    def _say_no_longer(self) -> None:
        """Say no longer that light is trapped, or behind all surfaces."""
        if self.session.message in (TRAPPED, BACKS):
            self.session.message = None

    def _seen(self, aspect: float) -> Texels:
        return seen_texels(self.session.lightmap.pool, self.camera.world_from_camera, self.camera.yfov, aspect)

    def atlas_image(self, size: tuple[int, int], *, turned: bool = False) -> Texture | None:
        """The virtual atlas with what was drawn last, v up or to the right; None before the first picture."""
        return self._renderer.atlas(self.session.lightmap, size, turned=turned)

    @property
    def texel_note(self) -> str | None:
        """Which materials have too few texels or too many for their light, in a line; looked at while the light stands still."""
        session = self.session
        still = not session.run.running or session.run.converged
        if still and session.solver.issued > 0 and self._texel_note[0] != session.state:
            self._texel_note = session.state, texel_note(texel_use(session, whole=False))
        return self._texel_note[1] if self._texel_note[0] == session.state else None

    # -- what the solver shows of itself -------------------------------------------------------------------------------

    def inspect(self, texel: tuple[int, int] | None = None) -> Inspection:
        """What there is to see of the solver's last work, and of a texel (column, row) of the tile pool; its rays as a picture,
        too. Its pictures are valid until it works or is asked again."""
        inspection = self.session.solver.inspect(texel, images=True)
        if texel is None or inspection.rays is None:
            return inspection
        self._take_rays(inspection.rays, texel)
        image = self._rays.hemisphere(self.display)
        return inspection if image is None else replace(inspection, images={**inspection.images, HEMISPHERE: image})

    def _marked_rays(self, *, whole: bool) -> RayPicture | None:
        """Those of the marked texel; if not ``whole``, not newer than a look a moment ago."""
        if self.marked is None or HEMISPHERE not in self.session.family.pictures:
            return None
        asked = self.session.lightmap, self.session.solver, self.marked
        if whole or asked != self._rays_of or time.perf_counter() >= self._rays_due:
            rays = self.session.solver.inspect(self.marked, images=True).rays
            if rays is None:
                return None
            self._take_rays(rays, self.marked)
        return self._rays

    def _take_rays(self, rays: Rays, texel: tuple[int, int]) -> None:
        lightmap = self.session.lightmap
        right = self.camera.world_from_camera[:3, 0]
        self._rays.show(rays.start, rays.end, rays.light / np.float32(np.pi), lightmap.normal_at(texel), right)
        self._rays_of = lightmap, self.session.solver, texel
        self._rays_due = time.perf_counter() + RAYS_SECONDS

    @property
    def _last_shooter(self) -> Rect | None:
        """Where the solver worked last, in atlas texels: of shooting, the patch that shot."""
        rectangles = self.session.solver.inspect().rectangles if self.display.last_shooter else {}
        return next(iter(rectangles.values()), None)

    # -- what lies under a pixel ---------------------------------------------------------------------------------------

    def pick(self, x_px: int, y_px: int) -> Picked | None:
        """What surface is at that pixel of the last frame, and the light on it; nothing where that was of another lightmap."""
        hit = self._renderer.pick(x_px, y_px) if self._renderer.shown is self.session.lightmap else None
        return None if hit is None else picked_from_hit(self.session.lightmap, hit, self.session.solver)

    def under(self, x_px: int, y_px: int) -> Picked | None:
        """What is under the pointer at that pixel of the last frame, as ``pick``."""
        return View.pick(self, x_px, y_px)

    def read_again(self, picked: Picked) -> Picked:
        """The same point with its texel and light as they are now."""
        lightmap = self.session.lightmap
        return picked_from_hit(lightmap, with_texel(picked.hit, lightmap), self.session.solver)

    # -- beside a reference --------------------------------------------------------------------------------------------

    @property
    def shown(self) -> DisplayOptions:
        """The display options, as far as there is what they ask for."""
        display = self._without_reference if self.session.compared.comparison is None else self.display
        return display if display.layer in self.layers else display.replace(layer="combined")

    @property
    def layers(self) -> tuple[str, ...]:
        """What the solver that is chosen allows to be shown."""
        return layers_with(self.session.family.layers)

    def drop_reference(self) -> None:
        """Show the solution alone again."""
        self.session.compared.drop()
        self.display = self._without_reference

    @property
    def _without_reference(self) -> DisplayOptions:
        layer = self.display.layer
        return self.display.replace(layer="combined" if LAYER_SHADERS[layer].compares else layer, show="solution")

    def _reference(self, *, whole: bool) -> Reference | None:
        """The light that is shown beside or instead of the solution's, and that errors are of."""
        display, comparison = self.display, self.session.compared.comparison
        if comparison is None:
            return None
        if display.show != "solution" or LAYER_SHADERS[display.layer].compares:
            comparison.texels.follow(whole=whole)
        return Reference(comparison.texels.texture, float(np.sqrt(3.0)) * comparison.dark)

    def release(self) -> None:
        self._drop_flat()
        self._rays.release()
        self._seams.release()
        self._renderer.release()
