"""Opens the real window over a session that only takes notes: what test_window.py drives with mouse and keys.

    python drive_window.py FOLDER

Writes FOLDER/state.json every few frames: where buttons and sliders are, what the session was asked to do. A file
name in FOLDER/drop is dropped on the window, as the window system would.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import moderngl_window
from fake_session import FakeSession
from imgui_bundle import imgui

from app.ui import widgets
from app.window import run_window

EVERY = 3  # frames between two reports


class ReportingSession(FakeSession):
    """Reports to the test, and hears from it, once per frame."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.folder, self.frame = folder, 0
        self.places: dict[str, tuple[float, float]] = {}

    def poll(self) -> None:
        self.frame += 1
        drop = self.folder / "drop"
        if drop.exists():
            dropped = drop.read_text()
            drop.unlink()
            moderngl_window.window()._window.dispatch_event("on_file_drop", 640, 360, [dropped])
        if self.frame % EVERY == 0:
            calls = [c for c in self.calls if c[0] in ("open", "pick")]
            state = {"frame": self.frame, "running": self.running, "exposure": self.display.exposure}
            report = self.folder / "state.new"
            report.write_text(json.dumps(state | {"calls": calls, "places": self.places}))
            report.replace(self.folder / "state.json")

    def note(self, function: Callable[..., Any], name: Callable[..., str]) -> Callable[..., Any]:
        """``function``, but the place of its widget is remembered."""

        def noting(*args: Any) -> Any:
            result = function(*args)
            low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            self.places[name(*args)] = (low.x + high.x) / 2, (low.y + high.y) / 2
            return result

        return noting


def main() -> None:
    session = ReportingSession(Path(sys.argv[1]))
    imgui.button = session.note(imgui.button, lambda label, *_: label.split("###")[-1])
    widgets._editor = session.note(widgets._editor, lambda spec, _: spec.name)
    run_window(lambda gpu: session, size=(1280, 720), vsync=False)
    assert ("release",) in session.calls
    print("closed")


main()
