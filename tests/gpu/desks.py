"""A desk to test the interface at: a fake session on a screen, and hands."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fake_session import FakeSession
from imgui_bundle import imgui

from app.gpu import Gpu
from app.ui import widgets
from app.ui.app import Ui
from app.ui.state import Request
from app.viewer.ui_frame import UiFrame, pixels

SIZE = (1280, 720)
VIEW = (640, 260)  # in the middle of the 3-D view
PICKED = SimpleNamespace(
    **{"triangle": 12, "object": "box", "material": 0, "back": False, "chart": 3, "facet": 4, "texel": (112, 93)},
    **{
        "position": (0.0, 0.0, -2.0),
        "normal": (0.0, 1.0, 0.0),
        "area": 6e-4,
        "facts": {"Patch": "28, 23 of 4×4 texels"},
        "parts": {},
        "B": (12.0, 8.0, 2.0),
    },
    **{"E": (0.0, 0.0, 0.0), "H": (16.0, 11.0, 3.0), "r": (0.02, 0.01, 0.004), "albedo": (0.7, 0.7, 0.7)},
)


class Desk:
    """A user before a screen: moves the mouse, presses keys, looks."""

    def __init__(self, gpu: Gpu, session: FakeSession, size: tuple[int, int] = SIZE, *, ui: Ui | None = None) -> None:
        self.session, self.size = session, size
        self.ui = ui or Ui(scenes=("cornell-box",), native_dialog=False)
        self.frame = UiFrame(gpu, self.ui)
        self.texture = gpu.texture(size, 4, "f1")
        self.target = gpu.target(self.texture)
        self.requests: list[Request] = []
        self.frames(3)

    def frames(self, count: int = 1, seconds: float = 1 / 60) -> None:
        for _ in range(count):
            self.requests += self.frame.draw(self.session, self.target, size=self.size, seconds=seconds)

    def front(self, panel: str) -> None:
        """Bring the tab of a panel to the front."""
        self.ui.use()
        imgui.set_window_focus(panel)
        self.frames(3)

    def point(self, x: float, y: float) -> None:
        self.ui.io.add_mouse_pos_event(x, y)
        self.frames()

    def press(self, button: int, down: bool) -> None:
        self.ui.io.add_mouse_button_event(button, down)
        self.frames()

    def click(self, x: float, y: float, button: int = 0) -> None:
        """Press and release between two frames: neither may be lost."""
        self.point(x, y)
        self.ui.io.add_mouse_button_event(button, True)
        self.ui.io.add_mouse_button_event(button, False)
        self.frames(3)

    def drag(self, start: tuple[float, float], end: tuple[float, float], button: int = 0) -> None:
        self.point(*start)
        self.press(button, True)
        self.point(*end)
        self.press(button, False)

    def ask_to_type(self, x: float, y: float) -> None:
        """Ctrl+click: what is there becomes a field for text."""
        self.ui.io.add_key_event(imgui.Key.mod_ctrl, True)
        self.click(x, y)
        self.ui.io.add_key_event(imgui.Key.mod_ctrl, False)
        self.frames(2)

    def key(self, key: imgui.Key, *, control: bool = False) -> None:
        for down in (True, False):
            if control:
                self.ui.io.add_key_event(imgui.Key.mod_ctrl, down)
            self.ui.io.add_key_event(key, down)
            self.frames(2)

    def image(self) -> np.ndarray:
        return pixels(self.target, self.size)

    def release(self) -> None:
        self.frame.release()
        self.ui.release()
        self.target.release()
        self.texture.release()


@pytest.fixture
def session() -> FakeSession:
    return FakeSession()


@pytest.fixture
def desk(gpu: Gpu, session: FakeSession) -> Iterator[Desk]:
    desk = Desk(gpu, session)
    yield desk
    desk.release()


@pytest.fixture
def where(monkeypatch: pytest.MonkeyPatch) -> dict[str, tuple[float, float]]:
    """Centres of buttons and sliders by label, as they are drawn: ``Pause``, ``level``."""
    centres: dict[str, tuple[float, float]] = {}

    def note(label: str) -> None:
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        centres[label] = ((low.x + high.x) / 2, (low.y + high.y) / 2)

    def noting(function: Callable[..., Any], name: Callable[..., str]) -> Callable[..., Any]:
        def wrapper(*args: Any, **named: Any) -> Any:
            result = function(*args, **named)
            note(name(*args))
            return result

        return wrapper

    monkeypatch.setattr(imgui, "button", noting(imgui.button, lambda label, *_: label.split("##")[0].split(" ")[-1]))
    monkeypatch.setattr(widgets, "_editor", noting(widgets._editor, lambda spec, *_: spec.name))
    return centres
