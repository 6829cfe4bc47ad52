"""One frame of the viewer into any framebuffer: the 3-D view in its place and the interface over it.

The window draws every frame with it; a headless shot with ``--ui`` draws one.
"""

from __future__ import annotations

import math
import time
from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from app.errors import UserError
from app.gpu import Framebuffer, Gpu, Pass, ShaderError, Texture
from app.gpu.imgui import ImguiRenderer
from app.render.false_colour import Scale, colour_map, measured, quantity
from app.render.resolve import BORDER, TEXELS_PER_FRAME, display_size
from app.session.view import View
from app.ui import theme
from app.ui.app import Ui
from app.ui.state import Legend, Request
from app.util.parts import run_to_end

LEGEND_COLOURS = 48
SCALE_SHARE = 0.05  # of the time may go into finding the false-colour scale
SCALE_SECONDS = 0.5  # between two searches, at least
WARM_UP = 4  # frames until docked windows, their contents' heights and scroll bars have settled
SAMPLES = 16  # pictures that one at rest, or one that is kept, is the mean of: smooth edges
LEGEND_SIZE = 900  # px: the shorter side of a picture beyond which its legend grows with it
STEP = 1.0 / 60.0  # s: a headless frame's time, whatever the clock says


class UiFrame:
    """Owns the interface's renderer and the target of the 3-D view; borrows the interface. Whoever makes it releases
    it.

    whole: show all light as it is now; False bounds the work of a frame, and where nothing moves each adds to the samples of the
    picture. unfinished: whether such samples are still to come, or a picture of what stands still now.
    """

    def __init__(self, gpu: Gpu, ui: Ui, *, whole: bool = True) -> None:
        self._gpu, self._ui, self._whole = gpu, ui, whole
        self.unfinished = False
        self._still: object = None  # what the last picture was of, where nothing moved
        ui.use()
        self._renderer = ImguiRenderer(gpu)
        self._present = Pass(gpu, "imgui/present")
        self._view: tuple[Texture, Framebuffer] | None = None
        self._scale: Scale | None = None
        self._scale_of: object = None
        self._scale_due = 0.0

    def draw(
        self,
        view: View,
        target: Framebuffer,
        *,
        size: tuple[float, float],
        ratio: float = 1.0,
        seconds: float = STEP,
        look: bool = True,
        add: bool = False,
    ) -> list[Request]:
        """Build and draw one frame into ``target``, and do what it asked of the session; what is left for the host to do.

        size: of the window [display units]; ratio: pixels per unit, so that the target has size·ratio pixels;
        seconds: since the last frame. look: draw the view anew, or show it as it was drawn last. add: one more sample to those
        of the view that were added before. For a screenshot all of them are drawn. Reloads shaders itself.
        """
        scale = self._false_colour(view)
        legend = None if scale is None else _legend(quantity(measured(view.shown), view.shown.quantities).name, scale)
        data = self._ui.frame(
            view, size=size, ratio=ratio, seconds=seconds, texture_id=self._renderer.texture_id, legend=legend
        )
        requests = self._ui.take_requests()
        left, bottom, width, height = self._ui.view_rect
        known = self._view
        texture, view_target = self._view_of(width, height)
        if not view.session.opened:
            if not view.draw_flat(view_target, (width, height)):
                view_target.clear(*theme.PANEL)
        elif Request.SCREENSHOT in requests:
            view.draw(view_target, (width, height), scale=scale, samples=SAMPLES)
        elif self._whole and (look or known is not self._view):
            view.draw(view_target, (width, height), scale=scale, add=add)
        elif not self._whole:
            self._look(view, view_target, scale, fresh=known is not self._view, look=look)
        target.use()
        target.clear(*theme.PANEL)
        self._present.draw(
            target,
            textures={"t_image": texture},
            viewport=(left, bottom, width, height),
        )
        self._renderer.draw(target, data)
        self._ui.act(view, seconds)
        if Request.RELOAD_SHADERS in requests:
            self._reload()
        return [r for r in (*requests, *self._ui.take_requests()) if r is not Request.RELOAD_SHADERS]

    def add_sample(self, view: View) -> None:
        """Add one sample to the picture of the view, for a ``draw`` that adds the last: the interface is built once."""
        _, _, width, height = self._ui.view_rect
        view.draw(self._view_of(width, height)[1], (width, height), scale=self._false_colour(view), add=True)

    def _look(self, view: View, target: Framebuffer, scale: Scale | None, *, fresh: bool, look: bool) -> None:
        """Draw the view within the time of a frame: where nothing moves, one more sample of it, until there are enough. fresh:
        nothing was drawn into ``target`` yet."""
        if view.waits_for_light and not fresh:
            self._still, self.unfinished = None, False
            return
        size, coarse = target.size, view.session.coarse
        now = None if view.still is None else (view.still, scale, size)
        if look or fresh:
            if now is None or now != self._still or fresh:  # coarse texels are few: they are drawn whole, and once
                if not view.draw(target, size, scale=scale, whole=coarse) and fresh:
                    target.clear(*theme.PANEL)
                self._still = now
            elif view.samples < SAMPLES and not coarse:
                view.draw(target, size, scale=scale, add=True)
        more = view.samples < SAMPLES and not coarse
        self.unfinished = now is not None and (more or now != self._still)

    def frames_to_show(self, view: View) -> int:
        """How many frames it takes until a change is seen everywhere."""
        if self._whole or not view.session.opened:
            return WARM_UP
        border = BORDER[view.display.interpolation]
        return WARM_UP + math.ceil(math.prod(display_size(view.session.lightmap, border)) / TEXELS_PER_FRAME)

    def release(self) -> None:
        """Give back the GL objects. The interface is still usable by another renderer, or can be released."""
        self._ui.use()
        self._renderer.release()
        self._release_view()

    def _view_of(self, width: int, height: int) -> tuple[Texture, Framebuffer]:
        if self._view is None or self._view[0].size != (width, height):
            self._release_view()
            texture = self._gpu.texture((width, height), 4, "f1")
            self._view = texture, self._gpu.target(texture)
        return self._view

    def _release_view(self) -> None:
        if self._view is not None:
            self._gpu.release_all(*self._view)
            self._view = None

    def _false_colour(self, view: View) -> Scale | None:
        """The scale of what is shown. Finding its top reads all light back, so that is done only now and then."""
        if not view.session.opened:
            return None
        display, lightmap = view.shown, view.session.lightmap
        kind = measured(display)
        if kind == "off":
            return None
        asked = (
            lightmap,
            view.session.solver,
            kind,
            display.quantities,
            display.false_colour_log,
            display.false_colour_max,
        )
        now = time.perf_counter()
        if self._scale is None or asked != self._scale_of or (now >= self._scale_due and not display.false_colour_max):
            self._scale = view.false_colour_scale()
            self._scale_of = asked
            cost = time.perf_counter() - now
            self._scale_due = now + max(SCALE_SECONDS, cost / SCALE_SHARE)
        return self._scale

    def _reload(self) -> None:
        state = self._ui.state
        try:
            self._gpu.shaders.reload()
        except ShaderError as error:
            state.notify(str(error).strip().splitlines()[0], error=True)
        else:
            state.notify("shaders reloaded")


def _legend(name: str, scale: Scale) -> Legend:
    colours = tuple((float(r), float(g), float(b)) for r, g, b in colour_map(LEGEND_COLOURS))
    return Legend(name.capitalize(), scale.unit, max(scale.low, 0.0), scale.high, scale.low > 0, colours)


def ui_image(
    view: View,
    size: tuple[int, int],
    *,
    measured: bool = True,
    click: tuple[float, float] | None = None,
) -> NDArray[np.uint8]:
    """The viewer's window as it would look, (height, width, 3) u8, top row first, for a ``size`` (width, height) [px].

    The session is not stepped. ``measured=False`` leaves out what depends on the machine's speed, so that pictures
    can be compared. click: a place in the window [px] that is clicked once it is there.
    """
    view.wait_for_light()
    return run_to_end(parts_of_ui_image(view, size, measured=measured, click=click))


def parts_of_ui_image(
    view: View,
    size: tuple[int, int],
    *,
    measured: bool = True,
    panels: bool = True,
    click: tuple[float, float] | None = None,
) -> Generator[float, None, NDArray[np.uint8]]:
    """The same in parts, one of the picture's samples after the other; yields the share that is drawn. ``panels=False`` leaves
    out all but the picture and the legend of its false colour."""
    gpu = view.session.gpu
    check_size(gpu, size)
    texture = gpu.texture(size, 4, "f1")
    target = gpu.target(texture)
    ui = Ui(measured=measured, live=False, scale=1.0 if panels else max(1.0, min(size) / LEGEND_SIZE))
    ui.state.show_ui = panels
    frame = UiFrame(gpu, ui)
    try:
        for _ in range(WARM_UP):
            frame.draw(view, target, size=size)
        if click is not None:
            ui.io.add_mouse_pos_event(*click)
            frame.draw(view, target, size=size)
            for down in (True, False):
                ui.io.add_mouse_button_event(0, down)
            for _ in range(WARM_UP):
                frame.draw(view, target, size=size)
        view.forget_samples()
        for drawn in range(1, SAMPLES):
            frame.add_sample(view)
            gpu.ctx.finish()
            yield drawn / SAMPLES
        frame.draw(view, target, size=size, add=True)
        return pixels(target, size)
    finally:
        frame.release()
        ui.release()
        gpu.release_all(target, texture)


def check_size(gpu: Gpu, size: tuple[int, int]) -> None:
    """Raise UserError for a picture that does not fit a texture of this GPU, or its memory, as the sum of its samples."""
    limit = gpu.limits.max_texture
    if not (1 <= min(size) and max(size) <= limit):
        raise UserError(f"a picture of {size[0]}×{size[1]} pixels: each side must be 1 to {limit} on this GPU")
    trial = gpu.texture(size, 4, "f4")
    try:
        gpu.release_all(gpu.target(trial))
    finally:
        gpu.release_all(trial)


def pixels(target: Framebuffer, size: tuple[int, int]) -> NDArray[np.uint8]:
    """The lower left ``size`` (width, height) of ``target``, (height, width, 3) u8, top row first. Waits for the
    GPU.
    """
    image = np.frombuffer(target.read(viewport=(0, 0, *size), components=3, alignment=1), np.uint8)
    return np.ascontiguousarray(image.reshape(size[1], size[0], 3)[::-1])
