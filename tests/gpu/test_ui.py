"""The user interface, driven by injected events over a session that only takes notes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fake_session import FakeSession
from imgui_bundle import imgui

from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.gpu import Gpu, ShaderError
from app.headless_ui import UiFrame, pixels, save_screenshot, ui_image
from app.options import Options, specs
from app.render.options import DisplayOptions
from app.solvers import ShootingOptions
from app.ui import layout, navigation, overlays, widgets
from app.ui.app import Ui
from app.ui.file_dialog import readable
from app.ui.keys import SHORTCUTS
from app.ui.panels import atlas
from app.ui.state import Legend, Pace, Request

SIZE = (1280, 720)
VIEW = (640, 260)  # in the middle of the 3-D view
PICKED = SimpleNamespace(
    **{"triangle": 12, "object": "box", "material": 0, "back": False, "chart": 3, "facet": 4, "texel": (112, 93)},
    **{
        "position": (0.0, 0.0, -2.0),
        "normal": (0.0, 1.0, 0.0),
        "area": 6e-4,
        "patch": (28, 23),
        "patch_edge": 4,
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
    monkeypatch.setattr(widgets, "_editor", noting(widgets._editor, lambda spec, _: spec.name))
    return centres


# -- keys --------------------------------------------------------------------------------------------------------------

EFFECTS: dict[str, Callable[[Desk], bool]] = {
    "F1": lambda d: d.ui.state.show_help,
    "F2": lambda d: not d.ui.state.show_ui,
    "F5": lambda d: any("reloaded" in t.text for t in d.ui.state.toasts),
    "F12": lambda d: Request.SCREENSHOT in d.requests,
    "Space": lambda d: not d.session.running,
    ".": lambda d: ("shoot",) in d.session.calls and not d.session.running,
    "R": lambda d: ("restart",) in d.session.calls,
    "F": lambda d: d.ui.state.flight is not None,
    "Ctrl+O": lambda d: imgui.is_popup_open("", imgui.PopupFlags_.any_popup_id | imgui.PopupFlags_.any_popup_level),
    "Esc": lambda d: Request.QUIT in d.requests,
}


@pytest.mark.parametrize("shortcut", SHORTCUTS, ids=lambda s: s.label)
def test_every_key_does_what_the_help_says(desk: Desk, shortcut: Any) -> None:
    assert not EFFECTS[shortcut.label](desk)
    desk.key(shortcut.key, control=shortcut.control)
    assert EFFECTS[shortcut.label](desk)


@pytest.mark.parametrize("shortcut", SHORTCUTS, ids=lambda s: s.label)
def test_keys_are_harmless_without_a_scene(gpu: Gpu, shortcut: Any) -> None:
    desk = Desk(gpu, FakeSession(opened=False))
    desk.key(shortcut.key, control=shortcut.control)
    desk.click(*VIEW)
    assert desk.session.calls == []
    desk.release()


def test_escape_closes_before_it_quits(desk: Desk) -> None:
    desk.key(imgui.Key.f1)
    desk.key(imgui.Key.escape)
    assert not desk.ui.state.show_help and Request.QUIT not in desk.requests
    cancelled: list[bool] = []
    desk.session.loading = SimpleNamespace(stage="unfolding", fraction=0.4, cancel=lambda: cancelled.append(True))
    desk.key(imgui.Key.escape)
    assert cancelled == [True] and Request.QUIT not in desk.requests
    desk.session.opened = False
    desk.key(imgui.Key.escape)
    assert cancelled == [True, True] and desk.requests == [Request.QUIT]
    desk.session.opened, desk.session.loading = True, None
    desk.requests.clear()
    desk.key(imgui.Key.o, control=True)
    desk.key(imgui.Key.escape)
    assert Request.QUIT not in desk.requests
    desk.key(imgui.Key.escape)
    assert desk.requests == [Request.QUIT]


def test_keys_typed_into_a_field_are_text(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.frames()
    desk.ui.io.add_key_event(imgui.Key.mod_ctrl, True)
    desk.click(*where["shots_per_frame"])
    desk.ui.io.add_key_event(imgui.Key.mod_ctrl, False)
    desk.frames(2)
    assert desk.ui.io.want_text_input
    desk.key(imgui.Key.space)
    desk.ui.io.add_input_characters_utf8("17")
    desk.key(imgui.Key.enter)
    assert desk.session.running
    assert desk.ui.state.pace.shots_per_frame == 17


# -- widgets -----------------------------------------------------------------------------------------------------------


def test_pause_button(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.frames()
    desk.click(*where["Pause"])
    assert not desk.session.running
    desk.click(*where["Run"])
    assert desk.session.running


def test_a_slider_changes_its_option_and_goes_back(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.frames()
    x, y = where["exposure"]
    desk.drag((x, y), (x + 40, y))
    assert desk.session.display.exposure > 1
    desk.click(x, y, button=1)
    assert desk.session.display.exposure == 0.0
    desk.drag((x, y), (x + 40, y))
    desk.click(x, y)
    desk.click(x, y)  # within Dear ImGui's double-click time
    assert desk.session.display.exposure == 0.0


def test_an_error_becomes_a_toast(gpu: Gpu, where: dict[str, tuple[float, float]]) -> None:
    desk = Desk(gpu, FakeSession(), (1920, 1080))

    def refuse(options: ShootingOptions) -> None:
        raise UserError("--level 4: no such level here")

    desk.session.set_shooting = refuse  # type: ignore[method-assign]
    desk.frames()
    x, y = where["level"]
    desk.drag((x, y), (x + 40, y))
    assert [t.text for t in desk.ui.state.toasts] == ["--level 4: no such level here"]
    desk.frames(10, seconds=1.0)
    assert desk.ui.state.toasts == []
    desk.release()


@pytest.mark.parametrize(
    "options", [Pace(), DisplayOptions(), ShootingOptions(), AtlasOptions()], ids=lambda o: type(o).__name__
)
def test_widgets_change_nothing_by_themselves(desk: Desk, options: Options) -> None:
    ratio = 1.0 + 1e-9  # values that 32-bit floats cannot hold must survive, too
    odd = {
        s.name: s.default * ratio
        for s in specs(type(options))
        if s.type is float and s.default and s.maximum != s.default
    }
    options = options.replace(**odd)
    desk.ui.use()
    imgui.new_frame()
    imgui.begin("alone")
    edited = widgets.edit_options(options)
    imgui.end()
    imgui.render()
    assert edited is options


def test_editing_a_material_tells_the_session(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    desk.ui.state.material = 3  # the lamp
    monkeypatch.setattr(imgui, "slider_float", lambda label, value, *_: (label == "##strength", 2 * value))
    desk.frames()
    (call,) = [c for c in desk.session.calls if c[0] == "set_material"]
    assert call[1] == 3
    np.testing.assert_allclose(call[2].emission, (34.0, 24.0, 8.0), rtol=1e-12)  # colour kept, strength doubled
    assert call[2].albedo == (0.78, 0.78, 0.78)


def test_a_lamp_that_was_switched_off_keeps_its_colour(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    desk.ui.state.material = 3
    for strength in (0.0, 5.0):
        monkeypatch.setattr(imgui, "slider_float", lambda label, *_, s=strength: (label == "##strength", s))
        desk.frames()
    np.testing.assert_allclose(desk.session.scene.materials[3].emission, (5.0, 5 * 12 / 17, 5 * 4 / 17), rtol=1e-12)


# -- the view ----------------------------------------------------------------------------------------------------------


def test_another_scene_of_the_same_name_is_another_scene(desk: Desk) -> None:
    state, session = desk.ui.state, desk.session

    def select() -> None:
        state.picked, state.material, state.atlas = PICKED, 2, AtlasOptions(texels=77)
        state.emission_colours[3] = (1.0, 0.0, 0.0)
        desk.frames()

    select()
    assert state.picked is PICKED and state.material == 2, "nothing is forgotten by itself"
    session.lightmap = SimpleNamespace(frame=session.lightmap.frame)  # the same scene, cut anew
    desk.frames()
    assert state.picked is None and state.atlas in (None, session.atlas)
    assert state.material == 2 and state.emission_colours
    select()
    session.unedited, session.lightmap = object(), SimpleNamespace(frame=session.lightmap.frame)
    desk.frames()
    assert state.picked is None and state.material == 0
    assert 3 not in state.emission_colours


def test_the_draft_of_a_cut_stays_until_it_is_done(gpu: Gpu, where: dict[str, tuple[float, float]]) -> None:
    desk, draft = Desk(gpu, FakeSession(), (1920, 1080)), AtlasOptions(texels=777)
    desk.ui.state.atlas = draft
    desk.session.loading = SimpleNamespace(stage="unfolding", fraction=0.4, cancel=lambda: None)
    desk.frames()
    desk.click(*where["anew"])
    assert ("set_atlas",) not in desk.session.calls, "a scene is on its way"
    desk.session.loading = None
    desk.frames()
    desk.click(*where["anew"])
    assert ("set_atlas",) in desk.session.calls and desk.ui.state.atlas == draft
    desk.release()


def test_a_click_picks_and_a_drag_does_not(desk: Desk) -> None:
    desk.session.picked = PICKED
    desk.session.running = False
    left, top, _, _ = desk.ui.state.view_px
    desk.click(*VIEW)
    assert desk.session.calls == [("pick", VIEW[0] - int(left), VIEW[1] - int(top))]
    assert desk.ui.state.picked is PICKED
    desk.drag(VIEW, (VIEW[0] + 60, VIEW[1]))
    assert len(desk.session.calls) == 1


MOVES = {
    "orbit": lambda d: d.drag(VIEW, (VIEW[0] + 60, VIEW[1] + 20)),
    "pan right": lambda d: d.drag(VIEW, (VIEW[0] + 60, VIEW[1] + 20), button=1),
    "pan middle": lambda d: d.drag(VIEW, (VIEW[0] + 60, VIEW[1] + 20), button=2),
    "wheel": lambda d: (d.point(*VIEW), d.ui.io.add_mouse_wheel_event(0, 1), d.frames()),
    "fly": lambda d: d.key(imgui.Key.w),
}


@pytest.mark.parametrize("move", MOVES)
def test_mouse_and_keys_move_the_eye(desk: Desk, move: str) -> None:
    before = desk.session.view.copy()
    MOVES[move](desk)
    after = desk.session.view
    assert not np.allclose(after.eye, before.eye)
    if move == "orbit":
        np.testing.assert_allclose(after.target, before.target, atol=1e-12)
    if move == "wheel":
        assert after.distance < before.distance
    if move.startswith("pan"):
        right = before.world_from_camera[:3, 0]
        assert (after.eye - before.eye) @ right < 0  # what is seen follows the mouse
        np.testing.assert_array_equal(after.world_from_camera[:3, :3], before.world_from_camera[:3, :3])


def test_the_mouse_over_a_panel_moves_nothing(desk: Desk) -> None:
    before = desk.session.view.copy()
    desk.drag((150, 200), (250, 260), button=2)
    desk.ui.io.add_mouse_wheel_event(0, 1)
    desk.frames(2)
    np.testing.assert_array_equal(desk.session.view.world_from_camera, before.world_from_camera)


@pytest.mark.parametrize("seconds", [1 / 240, 1 / 60, 1 / 7])
def test_movement_depends_on_time_not_on_frames(gpu: Gpu, seconds: float) -> None:
    desk = Desk(gpu, FakeSession(), (320, 240))
    desk.key(imgui.Key.f)
    desk.frames(math.ceil(0.4 / seconds), seconds)
    goal = desk.session.view.copy()
    goal.focus(np.zeros(3), 1.0)
    np.testing.assert_allclose(desk.session.view.eye, goal.eye, atol=1e-12)
    start = desk.session.view.eye.copy()
    desk.ui.io.add_key_event(imgui.Key.d, True)
    desk.frames(round(1 / seconds), seconds)
    moved = np.linalg.norm(desk.session.view.eye - start)
    desk.release()
    assert moved == pytest.approx(0.4, rel=0.01)  # radii per second; a frame more or less at 7 per second is not lost


def test_what_is_picked_is_read_again_while_shooting(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """The point, whatever its pixel shows after the eye has moved or the panels are hidden."""
    desk.session.picked = PICKED
    desk.click(*VIEW)
    desk.session.picked = None
    monkeypatch.setattr(navigation, "read_again", lambda session, picked: session.calls.append("read") or picked)
    for move in (lambda: None, lambda: desk.session.view.orbit(0.1, 0.0), lambda: desk.key(imgui.Key.f2)):
        move()
        before = desk.session.calls.count("read")
        desk.frames(20, seconds=0.05)
        assert 2 <= desk.session.calls.count("read") - before <= 4  # four times a second
        assert desk.ui.state.picked is PICKED
    desk.session.running = False
    before = len(desk.session.calls)
    desk.frames(20, seconds=0.05)
    assert len(desk.session.calls) == before


def test_the_atlas_is_drawn_only_where_it_is_seen(desk: Desk) -> None:
    insets = desk.session.insets
    desk.frames(3, seconds=1.0)
    (width, height), turned = insets[-1]
    assert not turned and 150 < width <= 512 and width / height == pytest.approx(160 / 96, rel=0.02)
    insets.clear()
    desk.ui.state.hidden_panels.add("Inspect")
    desk.frames(3, seconds=1.0)
    assert insets == []


@pytest.mark.parametrize("size", [(160, 96), (96, 160)], ids=str)
def test_pointing_at_the_atlas_tells_of_the_leaf(
    desk: Desk, gpu: Gpu, monkeypatch: pytest.MonkeyPatch, size: tuple[int, int]
) -> None:
    asked: list[tuple[float, float]] = []
    places: list[atlas.Place] = []

    def leaf(lightmap: object, uv: tuple[float, float]) -> SimpleNamespace:
        asked.append(uv)
        return SimpleNamespace(level=2, rect=(64.0, 32.0, 68.0, 36.0), texels=256, texel=0.01)

    place = atlas._place
    monkeypatch.setattr(atlas, "leaf_at", leaf)
    monkeypatch.setattr(atlas, "_place", lambda *args: places.append(place(*args)) or places[-1])
    desk.session.image = gpu.texture((64, 28), 4, "f1", bytes(64 * 28 * 4))
    desk.session.charts.size = size
    desk.point(5, 5)
    desk.frames(40)
    assert places[-1].turned == (size[0] < size[1]), "the longer edge lies along the longer one of what room there is"
    before, asked[:] = desk.image(), []
    assert len({(p.left, p.top, p.scale) for p in places[-10:]}) == 1, "it stays where it is"
    at = places[-1].screen_from_atlas(65.0, 33.0)
    desk.point(at.x, at.y)
    desk.frames(2)
    assert asked[-1] == pytest.approx((65.0, 33.0), abs=1 / places[-1].scale)  # Dear ImGui cuts to whole pixels
    corner = places[-1].screen_from_atlas(64.0, 32.0)
    assert (desk.image()[int(corner.y) - 1, int(corner.x) + 2] > 120).all(), "framed"
    assert (desk.image() != before).any(-1).sum() > 2000, "a tooltip"


# -- layout ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080), (2560, 1440)], ids=str)
def test_panels_stand_side_by_side(gpu: Gpu, size: tuple[int, int]) -> None:
    desk = Desk(gpu, FakeSession(), size)
    taken = np.zeros((size[1], size[0]), int)
    for panel in layout.PANELS:
        window = imgui.internal.find_window_by_name(panel.title)
        assert window.dock_id and window.size.x >= 280 and window.size.y >= 150, panel.title
        left, top = int(window.pos.x), int(window.pos.y)
        taken[top : top + int(window.size.y), left : left + int(window.size.x)] += 1
    left, top, width, height = (int(v) for v in desk.ui.state.view_px)
    taken[top : top + height, left : left + width] += 1
    assert taken.max() == 1  # nothing overlaps
    assert (taken == 1).mean() > 0.9  # the rest is bars and separators
    assert width * height > 0.3 * size[0] * size[1]
    desk.release()


def test_the_layout_is_kept_and_can_be_reset(gpu: Gpu, tmp_path: Path) -> None:
    places = []
    for change in ("drag a separator", "", "reset"):
        ui = Ui(layout_file=tmp_path / "layout.ini")
        desk = Desk(gpu, FakeSession(), ui=ui)
        if change == "reset":
            ui.state.rebuild_layout = True
            desk.frames(3)
        places.append(ui.state.view_px)
        if change == "drag a separator":
            left, top, _, height = ui.state.view_px
            desk.drag((left - 1, top + height / 2), (left + 49, top + height / 2))
            desk.frames(2)
            places.append(ui.state.view_px)
        desk.release()
    first, dragged, again, reset = places
    assert dragged[0] == pytest.approx(first[0] + 50, abs=2)  # where in the separator it was taken
    assert again == dragged
    assert reset == first


@pytest.mark.parametrize("size", [(320, 240), (640, 480)], ids=str)
def test_a_small_window_still_works(gpu: Gpu, size: tuple[int, int]) -> None:
    desk = Desk(gpu, FakeSession(), size)
    left, bottom, width, height = desk.ui.view_rect
    assert left >= 0 and bottom >= 0 and width >= 1 and height >= 1
    desk.release()


def test_hidden_interface_leaves_the_view_alone(desk: Desk) -> None:
    desk.key(imgui.Key.f2)
    assert desk.ui.view_rect == (0, 0, *SIZE)
    assert (
        np.abs(desk.image().astype(int) - np.array([51, 76, 102])).max() <= 1
    )  # the fake session's colour, everywhere


def test_the_view_is_drawn_in_its_place(desk: Desk) -> None:
    image = desk.image()
    left, bottom, width, height = desk.ui.view_rect
    top = SIZE[1] - bottom - height
    inside = image[top : top + height, left : left + width]
    assert np.abs(inside.astype(int) - np.array([51, 76, 102])).max() <= 1
    assert (np.abs(image[:, : left - 4].astype(int) - np.array([51, 76, 102])).max(axis=-1) > 1).all()


def test_pictures_of_the_same_state_are_the_same(gpu: Gpu) -> None:
    first, second = (ui_image(gpu, FakeSession(), (640, 400), measured=False) for _ in range(2))
    assert first.shape == (400, 640, 3)
    assert (first == second).all()
    assert first.std() > 10


@pytest.mark.parametrize("size", [(0, 100), (100, 10**6)], ids=str)
def test_a_picture_of_a_size_that_cannot_be(gpu: Gpu, size: tuple[int, int]) -> None:
    with pytest.raises(UserError, match=f"{size[0]}×{size[1]}"):
        ui_image(gpu, FakeSession(), size)


# -- the rest ----------------------------------------------------------------------------------------------------------


def test_screenshots_are_numbered(desk: Desk, tmp_path: Path) -> None:
    paths = [save_screenshot(desk.target, SIZE, tmp_path) for _ in range(2)]
    assert [p.name for p in paths] == ["glowtree-0001.png", "glowtree-0002.png"]
    with pytest.raises(UserError, match="nowhere"):
        save_screenshot(desk.target, SIZE, tmp_path / "nowhere")


def test_a_broken_shader_is_reported_and_nothing_else(desk: Desk, gpu: Gpu, monkeypatch: Any) -> None:
    def fail() -> None:
        raise ShaderError("app/shaders/imgui/draw.frag.glsl:3: syntax error\nmore")

    before = desk.image()
    monkeypatch.setattr(gpu.shaders, "reload", fail)
    desk.key(imgui.Key.f5)
    assert [t.text for t in desk.ui.state.toasts] == ["app/shaders/imgui/draw.frag.glsl:3: syntax error"]
    desk.frames(10, seconds=1.0)
    left, bottom, width, height = desk.ui.view_rect
    rows, columns = slice(SIZE[1] - bottom - height, SIZE[1] - bottom), slice(left, left + width)
    assert (desk.image()[rows, columns] == before[rows, columns]).all()


def test_files_are_listed_by_kind(tmp_path: Path) -> None:
    for name in ("b.glb", "a.TOML", "notes.txt", ".hidden.glb"):
        (tmp_path / name).touch()
    (tmp_path / "more").mkdir()
    assert [p.name for p in readable(tmp_path, (".glb", ".toml"))] == ["more", "a.TOML", "b.glb"]
    assert readable(tmp_path / "none", (".glb",)) == []


@pytest.mark.parametrize(
    ("low", "high", "logarithmic", "expected"),
    [
        (0.0, 500.0, False, [0, 100, 200, 300, 400, 500]),
        (0.0, 0.7, False, [0, 0.2, 0.4, 0.6]),
        (0.5, 500.0, True, [1, 10, 100]),
        (1.0, 100.0, True, [1, 2, 5, 10, 20, 50, 100]),
    ],
)
def test_ticks_are_round(low: float, high: float, logarithmic: bool, expected: list[float]) -> None:
    np.testing.assert_allclose(overlays.ticks(low, high, logarithmic), expected, rtol=1e-12)
    legend = Legend("E", "lx", low, high, logarithmic, ())
    places = [overlays.place(v, legend) for v in expected]
    assert places == sorted(places) and -1e-9 <= places[0] and places[-1] <= 1 + 1e-9


@pytest.mark.parametrize(
    ("value", "text"), [(0, "0"), (1234567.8, "1,234,568"), (0.012345, "0.01235"), (1e-9, "1.000e-09"), (34.6, "34.60")]
)
def test_numbers_are_short(value: float, text: str) -> None:
    assert widgets.number(value) == text
