"""The whole user interface: builds one frame over a session and hands back what is to be drawn. No GL, no window."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui, implot

from app.session.keeping import Keeping
from app.ui import edits, keys, layout, navigation, overlays, theme
from app.ui.files import Files, open_file
from app.ui.leave_dialog import leave_dialog
from app.ui.panels import bake
from app.ui.picture_dialog import PictureDialog
from app.ui.recovery import recovery
from app.ui.settings import KNOWN
from app.ui.state import Legend, Request, State
from app.util.recent import Recent

if TYPE_CHECKING:
    from app.session.view import View

SMALLEST_STEP = 1e-4  # s: Dear ImGui wants time to pass between frames
FPS_MEMORY = 0.9  # share of the last value in the running mean


class Ui:
    """Owns the Dear ImGui and ImPlot contexts; whoever makes it releases it, after the renderer of its frames.

    scale: of the screen: how large text and spacing are there, 1 on an ordinary one; the user's choice, ``state.text_size``,
    comes on top. layout_file: where the places of the panels are kept between runs, beside it those of other sizes of text.
    state_folder: where recent files are, and what a crash would lose. scenes: names or files offered in the menu. suffixes: of
    the files that can be opened; none: all files. measured: whether numbers that depend on the machine's speed are shown. live:
    whether frames follow each other.
    """

    def __init__(
        self,
        *,
        scale: float = 1.0,
        text_size: float = 1.0,
        layout_file: Path | None = None,
        state_folder: Path | None = None,
        scenes: Sequence[str] = (),
        suffixes: Sequence[str] = (),
        native_dialog: bool | None = None,
        measured: bool = True,
        live: bool = True,
    ) -> None:
        self._context = imgui.create_context()
        self._plots = implot.create_context()
        self.use()
        io = imgui.get_io()
        io.config_flags |= imgui.ConfigFlags_.docking_enable
        io.config_windows_move_from_title_bar_only = True
        theme.load_fonts()
        self.scale, self._applied, self._layout_file = scale, 0.0, layout_file
        self.state = State(measured=measured, live=live, scenes=tuple(scenes), text_size=text_size)
        self._apply_scale()
        self.state.rebuild_layout = False
        self.state.keeping = Keeping(None if state_folder is None else state_folder / "aside", KNOWN)
        self.state.recent = Recent(None if state_folder is None else state_folder / "recent.json")
        self.state.asides = self.state.keeping.asides()
        self._files = Files(suffixes, native=native_dialog)
        self._picture = PictureDialog(native=native_dialog)

    def use(self) -> None:
        """Make this interface's contexts the current ones."""
        imgui.set_current_context(self._context)
        implot.set_current_context(self._plots)

    @property
    def io(self) -> imgui.IO:
        """Where the host puts events: ``add_key_event`` and the others."""
        return imgui.get_io()

    def frame(
        self,
        view: View,
        *,
        size: tuple[float, float],
        ratio: float,
        seconds: float,
        texture_id: Callable[[Any], int],
        legend: Legend | None = None,
    ) -> imgui.ImDrawData:
        """Build one frame, which is to be drawn before ``act`` does what it asked of the session.

        size: of the window [display units]; ratio: pixels per unit; seconds: since the last frame. Afterwards ``view_rect`` is
        where the 3-D view goes, and ``take_requests`` what the host has to do.
        """
        self.use()
        state = self.state
        io = self.io
        io.display_size = imgui.ImVec2(*size)
        io.display_framebuffer_scale = imgui.ImVec2(ratio, ratio)
        io.delta_time = max(seconds, SMALLEST_STEP)
        state.texture_id, state.legend, state.ratio = texture_id, legend, ratio
        state.stats = view.session.stats if view.session.opened else None
        state.fps = FPS_MEMORY * state.fps + (1 - FPS_MEMORY) / io.delta_time if state.fps else 1 / io.delta_time
        if view.session.opened:
            state.remember(view.session.edited, view.session.lightmap)
        self._files.keep(view, state)
        self._apply_scale()
        imgui.new_frame()
        self._build(view, io.delta_time)
        imgui.render()
        return imgui.get_draw_data()

    def act(self, view: View, seconds: float) -> None:
        """Do what the last frame asked of the session, ``seconds`` after the one before: no earlier than that is drawn, since
        another solver or scene releases pictures that are in it. What the user did wrong becomes a toast."""
        self.use()
        state = self.state
        state.run_actions()
        state.held = self.held
        if state.baking is not None:
            bake.follow(state, state.baking)
        if view.session.opened:
            edits.watch(view, state, seconds)

    @property
    def view_rect(self) -> tuple[int, int, int, int]:
        """The 3-D view (left, bottom, width, height) [px], the origin at the lower left of the window."""
        left, top, width, height = self.state.view_px
        ratio = self.state.ratio
        x, x_end = round(left * ratio), round((left + width) * ratio)
        y, y_end = round(top * ratio), round((top + height) * ratio)
        return x, round(imgui.get_io().display_size.y * ratio) - y_end, max(x_end - x, 1), max(y_end - y, 1)

    @property
    def moving(self) -> bool:
        """Whether something of the interface changes by itself: a notice, a flight of the eye, a file dialog, a bake."""
        state = self.state
        return (
            bool(state.toasts)
            or state.flight is not None
            or state.drag_button >= 0
            or state.flying
            or self._files.waiting
            or self._picture.waiting
            or state.saving is not None
            or (state.baking is not None and state.baking.active)
        )

    @property
    def held(self) -> bool:
        """Whether a hand is at a control or moves the view."""
        self.use()
        state = self.state
        return (
            bool(imgui.is_any_item_active())
            or state.drag_button >= 0
            or state.split_held
            or state.light_held
            or state.area_held
            or state.flying
        )

    def take_requests(self) -> list[Request]:
        """What the host has to do, once."""
        requests, self.state.requests = self.state.requests, []
        return requests

    def release(self) -> None:
        """Destroy the contexts; a bake that is being written is waited for, and what a crash has left is there for others."""
        for aside in self.state.asides:
            aside.lock.release()
        if self.state.baking is not None:
            self.state.baking.release()
        self.use()
        implot.destroy_context(self._plots)
        imgui.destroy_context(self._context)

    def _apply_scale(self) -> None:
        """Text and spacing as large as the screen and the user want them; panels are laid out for that, or as they were left at
        that size."""
        wanted = self.scale * self.state.text_size
        if wanted == self._applied:
            return
        self._applied = wanted
        theme.apply(wanted)
        file = self._layout_file
        if file is not None and wanted != 1.0:
            file = file.with_stem(f"{file.stem}-{wanted:.2f}")
        self.io.set_ini_filename(None if file is None else str(file))
        self.state.rebuild_layout = True

    def _build(self, view: View, seconds: float) -> None:
        state = self.state
        keys.dispatch(view, state)
        state.lights_shown = False
        if state.show_ui:
            with theme.see_through():
                overlays.menu_bar(view, state)
                overlays.status_bar(view, state)
            layout.docks(state)
            layout.panels(view, state)
        else:
            state.view_px = (0.0, 0.0, self.io.display_size.x, self.io.display_size.y)
        if view.session.opened:
            navigation.navigate(view, state, seconds)
        overlays.invitation(view, state)
        overlays.no_lamps(view, state)
        self._files.frame(view, state)
        self._picture.draw(view, state)
        overlays.legend_overlay(state.legend, state)
        overlays.loading_overlay(view.session.on_its_way, state, coarse=view.session.coarse)
        overlays.toasts(view, state, seconds)
        overlays.help_overlay(state)
        leave_dialog(view, state)
        recovery(view, state)

    def drop(self, view: View, file: Path) -> None:
        """A file was dropped on the window, or is the first to be opened: a scene, a session, or the light of a bake."""
        open_file(view, self.state, file)
