"""The window: moderngl-window over pyglet gives context, events and time; every frame is poll, solve, draw.

Events go to Dear ImGui through its queue, so that a press shorter than a frame is seen; keys and mouse are answered by
``app.ui``, which knows no window.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from imgui_bundle import imgui
from moderngl_window import activate_context
from moderngl_window.context.base import WindowConfig
from moderngl_window.timers.clock import Timer

from app.errors import GpuError, UserError
from app.gpu import Gpu
from app.session.pacing import Turns
from app.session.view import View
from app.ui.app import Ui
from app.ui.state import Pace, Request
from app.viewer.keyboard import Keyboard, pyglet_keys
from app.viewer.mouse import Mouse
from app.viewer.saving import Pictures, save_screenshot
from app.viewer.ui_frame import UiFrame
from app.viewer.waiting import LOOK_PAUSE, Waiting

GL_VERSION = (4, 1)
TITLE = "Glowtree"
AWAKE_SECONDS = 1.0  # that frames go on after the last event: tooltips appear, scroll bars settle
WAITING_PAUSE = 0.2  # s between frames after an event, while there is only a scene to wait for
REST_SECONDS = 0.5  # between two looks around at rest; an event ends the rest at once
NOWHERE = -3.4e38  # where Dear ImGui has the mouse when it is outside the window
BUTTONS = {1: 0, 2: 1, 3: 2}  # left, right, middle: moderngl-window to Dear ImGui
# pyglet's events after which the window is drawn again
EVENTS = """
    on_key_press on_key_release on_text on_mouse_motion on_mouse_drag on_mouse_press on_mouse_release on_mouse_scroll
    on_mouse_enter on_mouse_leave on_file_drop on_resize on_expose on_show on_activate on_deactivate on_close
""".split()
CURSORS = {
    imgui.MouseCursor_.arrow: "CURSOR_DEFAULT",
    imgui.MouseCursor_.text_input: "CURSOR_TEXT",
    imgui.MouseCursor_.resize_all: "CURSOR_SIZE",
    imgui.MouseCursor_.resize_ns: "CURSOR_SIZE_UP_DOWN",
    imgui.MouseCursor_.resize_ew: "CURSOR_SIZE_LEFT_RIGHT",
    imgui.MouseCursor_.resize_nesw: "CURSOR_SIZE_DOWN_LEFT",
    imgui.MouseCursor_.resize_nwse: "CURSOR_SIZE_DOWN_RIGHT",
    imgui.MouseCursor_.hand: "CURSOR_HAND",
    imgui.MouseCursor_.not_allowed: "CURSOR_NO",
}


class Shown(NamedTuple):
    """What became of a window: how many frames were drawn, in how many seconds, and how large text was in the end."""

    frames: int
    seconds: float
    text_size: float


def run_window(
    make_view: Callable[[Gpu], View],
    *,
    size: tuple[int, int] = (1280, 720),
    scenes: Sequence[str] = (),
    suffixes: Sequence[str] = (),
    layout_file: Path | None = None,
    state_folder: Path | None = None,
    first: Path | None = None,
    pace: Pace | None = None,
    text_size: float = 1.0,
    vsync: bool = True,
    frames: int | None = None,
) -> Shown:
    """Open the window, run until it is closed, release everything.

    make_view: makes a view of a session once there is a context. size: of the window, in pixels of an ordinary screen. scenes:
    names for the menu. suffixes: of the files that can be opened. layout_file: keeps the places of the panels. state_folder:
    keeps recent files, and what a crash would lose. first: a file to open. pace, text_size: to begin with. frames: close after
    so many (for tests and measurements). Raises UserError where no window can be opened, and what ``make_view`` raises.
    """
    window = _open(size, vsync)
    gpu = Gpu(window.ctx)
    gpu.timers.enabled = True
    timer = Timer()
    try:
        view = make_view(gpu)
    except UserError:
        gpu.release()
        window.close()
        raise
    ui = Ui(
        scale=_text_scale(window),
        text_size=text_size,
        layout_file=layout_file,
        state_folder=state_folder,
        scenes=scenes,
        suffixes=suffixes,
    )
    frame = UiFrame(gpu, ui, whole=False)
    try:
        ui.state.pace = pace or ui.state.pace
        if first is not None:
            ui.drop(view, first)
            ui.state.run_actions()
        viewer, start = ViewerWindow(window, timer, view, frame, ui, frames), time.perf_counter()
        viewer.main_loop()
        ui.state.keeping.end()
        return Shown(viewer.frames, time.perf_counter() - start, ui.state.text_size)
    finally:
        frame.release()
        ui.release()
        view.release()
        view.session.release()
        gpu.release()
        window.close()  # last: it takes the context along


def no_display() -> str | None:
    """Why no window can be opened here, in one line; None where one can."""
    try:
        import moderngl_window.context.pyglet.window  # noqa: F401  # its import already opens the display
    except Exception as error:  # pyglet and X11 each raise their own
        return _reason(error)
    return None


def _reason(error: Exception) -> str:
    text = str(error).strip()
    if type(error).__name__ == "NoSuchDisplayException" and not os.environ.get("DISPLAY"):
        return "there is no display: DISPLAY is not set"
    return text.splitlines()[0] if text else type(error).__name__


def _open(size: tuple[int, int], vsync: bool) -> Any:
    """A pyglet window with an OpenGL 4.1 core context. Raises UserError."""
    try:
        from moderngl_window.context.pyglet.window import Window  # its import already opens the display

        window = Window(title=TITLE, size=size, gl_version=GL_VERSION, vsync=vsync, resizable=True)
    except GpuError:
        raise
    except Exception as error:  # pyglet, X11, GLX and moderngl each raise their own
        hint = "without a screen, use 'glowtree shot' or 'glowtree bake'"
        raise UserError(f"no window with OpenGL {GL_VERSION[0]}.{GL_VERSION[1]}: {_reason(error)}; {hint}") from None
    window.exit_key = None  # Esc closes what lies over the view
    window.fullscreen_key = None
    screen = window._window.screen
    fitting = size_on_screen(size, _text_scale(window), (screen.width, screen.height))
    if fitting != size:
        window._window.set_size(*fitting)
    activate_context(window=window)
    return window


def size_on_screen(size: tuple[int, int], scale: float, screen: tuple[int, int]) -> tuple[int, int]:
    """The size to open with, of one for ordinary text: larger as text is, and nowhere larger than the screen."""
    return min(round(size[0] * scale), screen[0]), min(round(size[1] * scale), screen[1])


def _text_scale(window: Any) -> float:
    """How much larger text must be on this screen: its scale, less what the framebuffer's pixels already give."""
    return max(1.0, float(window._window.scale) / window.pixel_ratio)


class ViewerWindow(WindowConfig):
    """Steps and draws a session, frame by frame, and passes events on. Owns none of what it is given."""

    clear_color = None  # type: ignore[assignment]  # the frame clears; the base class allows None, its type does not

    def __init__(
        self, window: Any, timer: Timer, view: View, frame: UiFrame, ui: Ui, frames: int | None = None
    ) -> None:
        super().__init__(ctx=window.ctx, wnd=window, timer=timer)
        self._view, self._session, self._frame, self._ui, self._frames_left = view, view.session, frame, ui, frames
        self._keyboard, self._mouse = Keyboard(pyglet_keys(), lambda: ui.io), Mouse(lambda: ui.io)
        self._pyglet = window._window
        self._cursor: int | None = None
        self._caption = ""
        self._turns, self._pictures = Turns(), Pictures(view, ui.state)
        self._waiting = Waiting(self._session)
        self._awake_until, self._touched_until, self._frames_due = 0.0, 0.0, 0
        self.frames = 0  # drawn so far
        ui.use()
        platform = imgui.get_platform_io()
        platform.platform_get_clipboard_text_fn = lambda _context: self._pyglet.get_clipboard_text()
        platform.platform_set_clipboard_text_fn = lambda _context, text: self._pyglet.set_clipboard_text(text)
        ui.io.backend_flags |= imgui.BackendFlags_.has_mouse_cursors
        self._pyglet.push_handlers(
            on_close=self._asked_to_close,
            on_activate=lambda: ui.io.add_focus_event(True),
            on_deactivate=self._on_deactivate,
            on_mouse_leave=lambda x, y: self._mouse.move(NOWHERE, NOWHERE),
            on_scale=self._on_scale,
        )
        self._pyglet.push_handlers(**dict.fromkeys(EVENTS, self._on_event))

    # -- frames --------------------------------------------------------------------------------------------------------

    def main_loop(self) -> None:
        """Frame after frame until the window is closed; where nothing changes, wait for an event instead."""
        self.timer.start()
        try:
            while not self.wnd.is_closing:
                if self._waits():
                    self._wait(LOOK_PAUSE)
                elif self._at_rest():
                    self._wait(REST_SECONDS)
                else:
                    self._next_frame()
        finally:
            self._pictures.end()

    def _next_frame(self) -> None:
        now, elapsed = self.timer.next_frame()
        self.wnd.use()
        self.wnd.render(now, min(elapsed, REST_SECONDS))
        if not self.wnd.is_closing:
            self.wnd.swap_buffers()
        if self._waiting.only:
            self._wait(WAITING_PAUSE)

    def _wait(self, seconds: float) -> None:
        """For an event, at most so long."""
        import pyglet

        pyglet.app.platform_event_loop.step(seconds)
        self._pyglet.dispatch_events()  # the step only queued them

    def _on_event(self, *_: object) -> None:
        self._touched_until = time.perf_counter() + AWAKE_SECONDS
        self._wake()

    def _wake(self) -> None:
        self._awake_until = time.perf_counter() + AWAKE_SECONDS
        self._frames_due = self._frame.frames_to_show(self._view)

    def _waits(self) -> bool:
        """Whether another frame would show no more than the last one of a scene that is on its way."""
        return not self._moves and time.perf_counter() > self._touched_until and self._waiting.idle()

    def _at_rest(self) -> bool:
        """Whether another frame would look like the last one."""
        if self._moves or not self._session.at_rest:
            self._wake()
        return time.perf_counter() > self._awake_until and self._frames_due <= 0

    @property
    def _moves(self) -> bool:
        """Whether something goes on beside the session's light, or each frame counts."""
        moves = self._ui.moving or self._frame.unfinished or self._pictures.busy
        return moves or self._frames_left is not None

    def on_render(self, time: float, frame_time: float) -> None:
        """Collect what is ready, solve within the budget, draw, do what was asked for."""
        session, state, look = self._session, self._ui.state, False
        self._pictures.step()
        try:
            if not self._pictures.drawing:
                look = self._solve(frame_time)
        except UserError as error:
            session.run.running = False
            state.notify(str(error), error=True)
            look = True
        target, ratio = self.wnd.fbo, self.wnd.pixel_ratio
        requests = self._frame.draw(self._view, target, size=self.wnd.size, ratio=ratio, seconds=frame_time, look=look)
        session.run.drawn()
        if self._mouse.frame():
            self._on_event()
        self._keyboard.frame()
        self._show_cursor()
        self._show_name()
        for request in requests:
            if request is Request.SCREENSHOT:
                save_screenshot(self.wnd.fbo, self.wnd.buffer_size, Path.cwd(), state)
            elif request is Request.SAVE_PICTURE and state.picture is not None:
                self._pictures.begin(state.picture)
            elif request is Request.QUIT:
                self.wnd.is_closing = True
        self._frames_due -= 1
        self.frames += 1
        if self._frames_left is not None:
            self._frames_left -= 1
            if self._frames_left <= 0:
                self.wnd.is_closing = True

    def _solve(self, frame_time: float) -> bool:
        """Collect what is ready, and solve within the budget; whether the view is to be drawn. Raises UserError."""
        session, look = self._session, True
        session.poll(interactive=self._ui.held)
        self._view.tell_observer()
        self._view.look_for_light()
        held, fast = self._ui.held, session.opened and self._ui.state.is_fast(session.run.seconds)
        solve, look = self._turns.next(frame_time) if session.solving and (held or not fast) else (True, True)
        if solve:
            session.advance(fast=fast, interactive=held)
        return look

    def _show_cursor(self) -> None:
        wanted = imgui.get_mouse_cursor()
        if wanted != self._cursor:
            self._cursor = wanted
            window = self._pyglet
            name = CURSORS.get(imgui.MouseCursor_(wanted), "CURSOR_DEFAULT")
            window.set_mouse_visible(wanted != imgui.MouseCursor_.none)
            window.set_mouse_cursor(window.get_system_mouse_cursor(getattr(window, name)))

    def _show_name(self) -> None:
        file = self._ui.state.keeping.path
        name = self._session.name if file is None else file.name
        caption = f"{name} - {TITLE}" if self._session.opened else TITLE
        if caption != self._caption:
            self._caption = caption
            self.wnd.title = caption

    # -- events --------------------------------------------------------------------------------------------------------

    def on_key_event(self, key: Any, action: Any, modifiers: Any) -> None:
        """A key went down or up."""
        self._keyboard.key(key, action == self.wnd.keys.ACTION_PRESS)

    def on_unicode_char_entered(self, char: str) -> None:
        """Text was typed."""
        self._keyboard.text(char)

    def on_mouse_position_event(self, x: int, y: int, dx: int, dy: int) -> None:
        """The mouse moved."""
        self._mouse.move(x, y)

    def on_mouse_drag_event(self, x: int, y: int, dx: int, dy: int) -> None:
        """The mouse moved with a button down."""
        self._mouse.move(x, y)

    def on_mouse_press_event(self, x: int, y: int, button: int) -> None:
        """A mouse button went down."""
        self._mouse.button(x, y, BUTTONS[button], True)

    def on_mouse_release_event(self, x: int, y: int, button: int) -> None:
        """A mouse button went up."""
        self._mouse.button(x, y, BUTTONS[button], False)

    def on_mouse_scroll_event(self, x_offset: float, y_offset: float) -> None:
        """The wheel turned."""
        self._mouse.scroll(x_offset, y_offset)

    def on_files_dropped_event(self, x: int, y: int, paths: list[str]) -> None:
        """Files were dropped: the first one is opened."""
        if paths:
            self._ui.drop(self._view, Path(paths[0]))

    def _asked_to_close(self) -> bool:
        """The window's own button: the interface may have a question first. True: pyglet does nothing of its own."""
        self._ui.state.quit()
        return True

    def _on_scale(self, scale: float, dpi: int) -> None:
        """The window has come to a screen whose pixels are of another size."""
        self._ui.scale = _text_scale(self.wnd)
        self._wake()

    def _on_deactivate(self) -> None:
        self._keyboard.forget()
        self._ui.io.add_focus_event(False)
