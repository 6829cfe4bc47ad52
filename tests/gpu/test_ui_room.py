"""Every label, value and button of every panel has the room that its text takes, in small, ordinary and dense windows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from fake_session import FakeSession
from imgui_bundle import imgui
from test_ui_ids import DISPLAYS, everything

from app.solvers import SOLVERS
from app.ui import layout, slider, widgets
from app.ui.app import Ui

WINDOWS = (((900, 2400), 1.0), ((1280, 2400), 1.0), ((2560, 4800), 2.0))  # high enough for all that a panel has
SLACK = 1.0  # px, of rounding


class Clipped:
    """What did not fit, by the panel that it is in."""

    def __init__(self) -> None:
        self.found: set[str] = set()

    def note(self, text: str, needed: float, room: float) -> None:
        if needed > room + SLACK:
            window = imgui.internal.get_current_window().name
            self.found.add(f"{window}: {text!r} takes {needed:.0f} px of {room:.0f}")

    def inside(self, text: str) -> None:
        """The last item, in its window or column of a table."""
        self.note(text, imgui.get_item_rect_max().x, imgui.internal.get_current_window().clip_rect.max.x)

    def within(self, text: str, rest: float) -> None:
        """A text in the last item, of which ``rest`` [px] is taken by other things."""
        width = imgui.get_item_rect_max().x - imgui.get_item_rect_min().x
        self.note(text, imgui.calc_text_size(text).x, width - rest)


@pytest.fixture
def clipped(monkeypatch: pytest.MonkeyPatch) -> Iterator[Clipped]:
    """Looks at everything that is drawn; all sections are open."""
    found = Clipped()

    def looking(module: Any, name: str, look: Callable[..., None]) -> None:
        function = getattr(module, name)

        def wrapper(*args: Any, **named: Any) -> Any:
            result = function(*args, **named)
            look(*args, **named)
            return result

        monkeypatch.setattr(module, name, wrapper)

    def padding() -> float:
        return float(2 * imgui.get_style().frame_padding.x)

    looking(imgui, "text_unformatted", found.inside)
    looking(imgui, "text_colored", lambda _, text: found.inside(text))
    for name in ("checkbox", "radio_button", "small_button"):
        looking(imgui, name, lambda label, *_: found.inside(label))
    looking(imgui, "button", lambda label, *_: found.within(label.split("##")[0], padding()))
    looking(imgui, "combo", lambda _, now, names, *__: found.within(names[now], padding() + imgui.get_frame_height()))
    looking(slider, "slide", lambda _, value, ends, text: found.within(text % value if "%" in text else text, 0.0))
    looking(
        widgets, "labelled", lambda text, **_: found.note(text, imgui.calc_text_size(text).x + padding(), _column())
    )
    opened = imgui.set_next_item_open
    monkeypatch.setattr(imgui, "set_next_item_open", lambda *_: opened(True, imgui.Cond_.always))
    yield found


def _column() -> float:
    """Width of the column of labels, after a label [px]."""
    return imgui.get_cursor_pos_x() - imgui.get_style().window_padding.x


def look(clipped: Clipped, ui: Ui, session: FakeSession, size: tuple[int, int]) -> set[str]:
    """What does not fit in any panel, layer and false colour; nothing is drawn."""
    found: set[str] = set()

    def build() -> None:
        ui.frame(session, size=size, ratio=1.0, seconds=1 / 60, texture_id=lambda texture: 1)  # type: ignore[arg-type]

    for panel in layout.PANELS:
        imgui.set_window_focus(panel.title)
        for display in DISPLAYS:
            session.display = display
            build()
            build()  # until tables know their columns
            clipped.found.clear()
            build()
            found |= clipped.found
    return found


@pytest.mark.parametrize(("size", "scale"), WINDOWS, ids=str)
@pytest.mark.parametrize("solver", list(SOLVERS))
def test_everything_has_room(clipped: Clipped, solver: str, size: tuple[int, int], scale: float) -> None:
    session = FakeSession()
    session.solver_name, session.family = solver, SOLVERS[solver]
    session.options, session.image = SOLVERS[solver].options(), SimpleNamespace(size=(64, 32), glo=1)
    ui = Ui(scale=scale, native_dialog=False)
    ui.io.backend_flags |= imgui.BackendFlags_.renderer_has_textures  # nothing is drawn
    desk: Any = SimpleNamespace(ui=ui, session=session)
    found = look(clipped, ui, session, size)
    everything(desk)
    found |= look(clipped, ui, session, size)
    ui.release()
    assert not found, "\n".join(sorted(found))
