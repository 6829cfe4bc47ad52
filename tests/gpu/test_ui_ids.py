"""No two controls of a window have the same identity: Dear ImGui would answer one for the other, and says so in red."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from desks import PICKED, Desk
from fake_session import MATERIALS, FakeSession
from imgui_bundle import imgui

from app.gpu import Gpu
from app.render.options import DisplayOptions
from app.scene.lights import Light
from app.scene.sky import Sky, Sun
from app.solvers import SOLVERS
from app.ui import layout

SIZE = (1920, 2400)  # high enough for every section of every panel
CONTROLS = """
    button small_button invisible_button selectable checkbox radio_button combo menu_item begin_menu collapsing_header tree_node
    drag_float drag_float3 drag_int input_text input_float color_edit3
    color_button color_picker3 begin_combo text_link arrow_button
""".split()


class Identities:
    """Of the controls of one frame: the identity of each, how often it came, and where and as what."""

    def __init__(self) -> None:
        self.seen: Counter[int] = Counter()
        self.told: dict[int, list[str]] = {}
        self.places: dict[int, tuple[float, float]] = {}

    def note(self, label: str) -> None:
        identity = imgui.get_item_id()
        if identity:
            low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            window = imgui.internal.get_current_window().name
            self.seen[identity] += 1
            self.told.setdefault(identity, []).append(f"{label!r} in {window!r}")
            self.places[identity] = (low.x + high.x) / 2, (low.y + high.y) / 2

    @property
    def shared(self) -> list[list[str]]:
        return [self.told[identity] for identity, count in self.seen.items() if count > 1]

    def clear(self) -> None:
        self.__init__()  # type: ignore[misc]


@pytest.fixture
def identities(monkeypatch: pytest.MonkeyPatch) -> Iterator[Identities]:
    """Notes every control that is drawn; all sections are open."""
    found = Identities()

    def noting(function: Callable[..., Any]) -> Callable[..., Any]:
        def wrapper(label: str, *args: Any, **named: Any) -> Any:
            result = function(label, *args, **named)
            found.note(label)
            return result

        return wrapper

    for name in CONTROLS:
        monkeypatch.setattr(imgui, name, noting(getattr(imgui, name)))
    opened = imgui.set_next_item_open
    monkeypatch.setattr(imgui, "set_next_item_open", lambda *_: opened(True, imgui.Cond_.always))
    yield found


def plain(desk: Desk) -> None:
    pass


def compared(desk: Desk) -> None:
    desk.session.compare()


def solved_in_the_background(desk: Desk) -> None:
    desk.session.compared.fetching = SimpleNamespace(stage="12 shots", fraction=0.3)


def picked(desk: Desk) -> None:
    desk.ui.state.picked = PICKED  # type: ignore[assignment]


def lamps_and_sky(desk: Desk) -> None:
    scene = desk.session.scene
    scene.lights = (Light("lamp"), Light("lamp", "spot"), Light("", "directional"))
    scene.sky = Sky("clear", sun=Sun(100, 20))


def names_that_are_shared(desk: Desk) -> None:
    desk.session.scene.materials = desk.session.unedited.materials = (*MATERIALS, *MATERIALS, MATERIALS[0])
    desk.session.scene.warnings = desk.session.scene.warnings * 2


def on_its_way(desk: Desk) -> None:
    desk.session.loading = SimpleNamespace(stage="unfolding", fraction=0.4, cancel=lambda: None)


def helped(desk: Desk) -> None:
    desk.ui.state.show_help = True
    desk.ui.state.notify("a toast")
    desk.ui.state.notify("another", error=True)


def asks_for_a_file(desk: Desk) -> None:
    desk.ui.state.ask_for_file = True


def everything(desk: Desk) -> None:
    for state in (compared, picked, lamps_and_sky, names_that_are_shared, helped):
        state(desk)


STATES = (
    *(plain, compared, solved_in_the_background, picked, lamps_and_sky, names_that_are_shared, on_its_way, helped),
    *(asks_for_a_file, everything),
)


DISPLAYS = (
    *(DisplayOptions(), DisplayOptions(layer="error"), DisplayOptions(show="split")),
    DisplayOptions(false_colour="illuminance", false_colour_max=500.0, false_colour_log=False),
)
VIEWS = (*((display, 0) for display in DISPLAYS), *((DISPLAYS[0], chosen) for chosen in (1, 2)))


def build(desk: Desk, count: int = 1) -> None:
    """Frames that are not drawn."""
    for _ in range(count):
        desk.ui.frame(desk.session, size=SIZE, ratio=1.0, seconds=1 / 60, texture_id=lambda texture: texture.glo)  # type: ignore[arg-type]


def walk(desk: Desk, found: Identities) -> int:
    """Each panel in front, in each layer and false colour, and with each light and material chosen. How many controls there were
    at once, at most."""
    most = 0
    for panel in layout.PANELS:
        imgui.set_window_focus(panel.title)
        build(desk, 2)
        for display, chosen in VIEWS:
            desk.session.display = display
            desk.ui.state.light = desk.ui.state.material = chosen
            found.clear()
            build(desk)
            assert found.shared == [], panel.title
            most = max(most, len(found.seen))
    return most


def desk_of(gpu: Gpu, solver: str) -> Desk:
    session = FakeSession()
    session.solver_name, session.family = solver, SOLVERS[solver]
    session.options = SOLVERS[solver].options()
    return Desk(gpu, session, SIZE)


@pytest.mark.parametrize("solver", list(SOLVERS))
def test_no_two_controls_are_the_same(gpu: Gpu, identities: Identities, solver: str) -> None:
    """In all states of the first solver; of the others, whose own controls are in the Solver panel, in the plainest and the
    fullest."""
    for state in STATES if solver == next(iter(SOLVERS)) else (plain, everything):
        desk = desk_of(gpu, solver)
        state(desk)
        assert walk(desk, identities) > 20, "the panels were drawn"
        desk.release()


def test_no_two_controls_are_the_same_without_a_scene(gpu: Gpu, identities: Identities) -> None:
    desk = Desk(gpu, FakeSession(opened=False), SIZE)
    identities.clear()
    build(desk)
    assert len(identities.seen) > 2 and identities.shared == []
    desk.release()


def test_dear_imgui_agrees(gpu: Gpu, identities: Identities) -> None:
    """It counts the controls under the pointer that are the same: pointed at each control, it finds no second one."""
    desk = desk_of(gpu, next(iter(SOLVERS)))
    everything(desk)
    context, counts = imgui.get_current_context(), []
    for panel in ("Compare", "Solver", "Lights", "Materials"):
        imgui.set_window_focus(panel)
        build(desk, 2)
        identities.clear()
        build(desk)
        for place in list(identities.places.values()):
            desk.ui.io.add_mouse_pos_event(*place)
            build(desk, 2)
            counts.append(context.hovered_id_previous_frame_item_count)
    assert len(counts) > 50 and max(counts) == 1
    desk.release()
