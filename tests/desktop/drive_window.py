"""Opens the real window over a real session that reports to test_window.py, which drives it with mouse and keys.

    python drive_window.py FOLDER [SECONDS]

Writes FOLDER/state.json every few frames: where buttons and sliders are, and where the session stands. A file name in
FOLDER/drop is dropped on the window, and a FOLDER/close presses its close button, as the window system would. A FOLDER/enough
ends the solve with half of what remains now. SECONDS: of solving, after which quitting asks.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import moderngl_window
import pyglet
from imgui_bundle import imgui

from app.estimate import error
from app.gpu import Gpu
from app.session import keeping
from app.session.session import Session
from app.session.view import View
from app.ui import light_gizmos, slider, widgets
from app.viewer.window import run_window

EVERY = 3  # frames between two reports


class ReportingView(View):
    """Remembers what was picked, and where widgets are."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.places: dict[str, tuple[float, float]] = {}
        self.picked: str | None = None

    def pick(self, x_px: int, y_px: int) -> Any:
        picked = super().pick(x_px, y_px)
        self.picked = None if picked is None else picked.object
        return picked

    def note(self, function: Callable[..., Any], name: Callable[..., str]) -> Callable[..., Any]:
        """``function``, but the place of its widget is remembered."""

        def noting(*args: Any) -> Any:
            result = function(*args)
            low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            self.places[name(*args)] = (low.x + high.x) / 2, (low.y + high.y) / 2
            return result

        return noting

    def note_point(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """``function``, but the point that it finds is remembered as that of a handle."""

        def noting(*args: Any, **more: Any) -> Any:
            at = function(*args, **more)
            if at is not None:
                self.places["handle"] = at.x, at.y
            return at

        return noting

    def note_tab(self, panel: str) -> None:
        """Remember where the tab of a docked panel is."""
        window = imgui.internal.find_window_by_name(panel)
        if window is not None:
            tab = window.dc.dock_tab_item_rect
            self.places[f"tab {panel}"] = (tab.min.x + tab.max.x) / 2, (tab.min.y + tab.max.y) / 2


class ReportingSession(Session):
    """Tells the test, every few frames, how it is, and its view."""

    def __init__(self, gpu: Gpu, folder: Path) -> None:
        super().__init__(gpu, expose_on_open=True)
        self.folder, self.frame = folder, 0
        self.view = ReportingView(self)

    def poll(self, *, interactive: bool = False) -> None:
        super().poll(interactive=interactive)
        pyglet.app.platform_event_loop.dispatch_posted_events()  # of the test; at rest the window does it
        if (self.folder / "enough").exists():
            (self.folder / "enough").unlink()
            self.set_options(self.options.replace(residual=self.run.progress.remaining / 2))
        self.frame += 1
        if self.frame % EVERY == 0:
            for panel in ("Bake", "Lights", "Materials"):
                self.view.note_tab(panel)
            self.view.places["row"] = 0.0, imgui.get_text_line_height_with_spacing()
            state = {
                "frame": self.frame,
                "name": self.name,
                "running": self.run.running,
                "at_rest": self.at_rest,
                "shots": self.solver.issued if self.opened else 0,
                "exposure": self.view.display.exposure,
                "message": self.message,
                "picked": self.view.picked,
                "has_picked": self.view.marked is not None,
                "places": self.view.places,
                "layer": self.view.display.layer,
                "lights": [light.position for light in self.edited_scene.lights] if self.opened else [],
                "scales": [m.lightmap_scale for m in self.unedited.materials] if self.opened else [],
            }
            report = self.folder / "state.new"
            report.write_text(json.dumps(state))
            report.replace(self.folder / "state.json")


def pass_on_events(folder: Path) -> None:
    """What the test drops, and its wish to close: also while the window waits for an event."""
    while True:
        for kind in ("drop", "close"):
            asked = folder / kind
            if asked.exists():
                text = asked.read_text()
                asked.unlink()
                event = ("on_file_drop", 640, 360, [text]) if kind == "drop" else ("on_close",)
                pyglet.app.platform_event_loop.post_event(moderngl_window.window()._window, *event)
        time.sleep(0.1)


def main() -> None:
    folder = Path(sys.argv[1])
    for name in ("SURVEYED", "POINTS", "HELPERS"):  # of the error estimate, which takes some in each frame
        setattr(error, name, 64)
    if len(sys.argv) > 2:
        keeping.WORTH_SECONDS = float(sys.argv[2])

    def make_view(gpu: Gpu) -> View:
        session = ReportingSession(gpu, folder)
        imgui.button = session.view.note(imgui.button, lambda label, *_: label.split("###")[-1])
        slider.slide = session.view.note(slider.slide, lambda label, *_: label)
        light_gizmos.on_screen = session.view.note_point(light_gizmos.on_screen)
        widgets._editor = session.view.note(widgets._editor, lambda spec, *_: spec.name)
        session.open("cornell-box")
        return session.view

    threading.Thread(target=pass_on_events, args=(folder,), daemon=True).start()
    run_window(make_view, size=(1280, 720), vsync=False)
    print("closed")


main()
