"""The user interface, driven by injected events over a session that only takes notes: keys, widgets, and the rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from desks import PICKED, SIZE, VIEW, Desk, desk, session, where
from fake_session import FakeScene, FakeSession
from imgui_bundle import imgui

from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.gpu import Gpu, ShaderError
from app.options import Options, specs
from app.render.options import DisplayOptions
from app.scene.lights import Light
from app.scene.sky import Sky, Sun
from app.session.keeping import WORTH_SECONDS
from app.solvers import SOLVERS, ShootingOptions
from app.ui import overlays, slider, widgets
from app.ui.app import Ui
from app.ui.file_list import readable
from app.ui.keys import ANY_POPUP, SHORTCUTS
from app.ui.picture_dialog import free_name
from app.ui.state import WATCH_SECONDS, Legend, Pace, Request, Saving
from app.viewer.saving import save_screenshot

__all__ = ["desk", "session", "where"]

# -- keys --------------------------------------------------------------------------------------------------------------


EFFECTS: dict[str, Callable[[Desk], bool]] = {
    "F1": lambda d: d.ui.state.show_help,
    "F2": lambda d: not d.ui.state.show_ui,
    "F5": lambda d: any("reloaded" in t.text for t in d.ui.state.toasts),
    "F12": lambda d: Request.SCREENSHOT in d.requests,
    "Space": lambda d: not d.session.running,
    ".": lambda d: ("work",) in d.session.calls and not d.session.running,
    "P": lambda d: d.ui.state.pace.is_fast(d.session.seconds),
    "R": lambda d: ("restart",) in d.session.calls,
    "F": lambda d: d.ui.state.flight is not None,
    "C": lambda d: d.session.display.show == "reference",
    "V": lambda d: d.session.display.show == "split",
    "X": lambda d: d.session.display.layer == "error",
    "Ctrl+P": lambda d: imgui.is_popup_open("", ANY_POPUP),
    "Ctrl+O": lambda d: imgui.is_popup_open("", ANY_POPUP),
    "Ctrl+Z": lambda d: d.session.display.exposure == 0,
    "Ctrl+Shift+Z": lambda d: d.session.display.exposure == 2,
    "Ctrl+S": lambda d: imgui.is_popup_open("", ANY_POPUP),
    "Ctrl+Shift+S": lambda d: imgui.is_popup_open("", ANY_POPUP),
    "Ctrl+Q": lambda d: Request.QUIT in d.requests,
    "Esc": lambda d: d.ui.state.picked is None,
}


def test_help_stays_within_a_small_window(gpu: Gpu, session: FakeSession) -> None:
    desk = Desk(gpu, session, (900, 500))
    desk.ui.state.show_help = True
    desk.frames(3)
    help_window = imgui.internal.find_window_by_name("##help")
    assert help_window.pos.x >= 0 and help_window.pos.x + help_window.size.x <= 900
    assert help_window.pos.y >= 0 and help_window.pos.y + help_window.size.y <= 500
    assert help_window.scroll_max.y > 0, "the rest is reached by the wheel"
    desk.release()


@pytest.mark.parametrize("shortcut", SHORTCUTS, ids=lambda s: s.label)
def test_every_key_does_what_the_help_says(desk: Desk, shortcut: Any) -> None:
    desk.session.compare()
    desk.ui.state.picked = PICKED
    desk.session.display = desk.session.display.replace(exposure=2.0)
    desk.frames()
    if shortcut.key == imgui.Key.z and shortcut.shift:
        desk.key(imgui.Key.z, control=True)
    if shortcut.shift:
        desk.ui.io.add_key_event(imgui.Key.mod_shift, True)
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


def test_escape_closes_cancels_deselects_and_never_quits(desk: Desk) -> None:
    desk.session.picked = PICKED
    desk.click(*VIEW)
    assert desk.ui.state.picked is PICKED
    desk.key(imgui.Key.f1)
    cancelled: list[bool] = []
    desk.session.loading = SimpleNamespace(stage="unfolding", fraction=0.4, cancel=lambda: cancelled.append(True))
    desk.key(imgui.Key.escape)
    assert not desk.ui.state.show_help and not cancelled, "one thing at a time"
    desk.key(imgui.Key.escape)
    assert cancelled == [True] and desk.ui.state.picked is PICKED
    desk.session.loading = None
    desk.key(imgui.Key.o, control=True)
    desk.key(imgui.Key.escape)
    assert not imgui.is_popup_open("", ANY_POPUP) and desk.ui.state.picked is PICKED
    desk.key(imgui.Key.escape)
    assert desk.ui.state.picked is None
    desk.session.opened = False
    desk.key(imgui.Key.escape)
    assert desk.requests == [], "with nothing left it does nothing"


def test_a_click_on_nothing_drops_what_was_picked(desk: Desk) -> None:
    desk.session.picked = PICKED
    desk.click(*VIEW)
    desk.session.picked = None
    desk.click(*VIEW)
    assert desk.ui.state.picked is None


@pytest.mark.parametrize("answer", ["Quit", "Cancel"])
def test_quitting_asks_where_a_long_solve_would_be_lost(
    desk: Desk, where: dict[str, tuple[float, float]], answer: str
) -> None:
    desk.session.seconds = 2 * WORTH_SECONDS
    desk.key(imgui.Key.q, control=True)
    desk.frames(2)
    assert desk.requests == [] and imgui.is_popup_open("", ANY_POPUP)
    desk.key(imgui.Key.space)
    assert desk.session.running, "keys wait for the answer"
    desk.click(*where[answer])
    assert desk.requests == [Request.QUIT] * (answer == "Quit") and not imgui.is_popup_open("", ANY_POPUP)


@pytest.mark.parametrize("answer", ["Open", "Cancel"])
def test_another_scene_asks_where_a_long_solve_would_be_lost(
    desk: Desk, where: dict[str, tuple[float, float]], answer: str
) -> None:
    desk.session.seconds = 2 * WORTH_SECONDS
    desk.ui.drop(desk.session, Path("other.glb"))
    desk.frames(3)
    assert desk.session.calls == [] and imgui.is_popup_open("", ANY_POPUP)
    desk.click(*where[answer])
    opened = [("open", "other.glb")] if answer != "Cancel" else []
    assert desk.session.calls == opened and not imgui.is_popup_open("", ANY_POPUP)


@pytest.mark.parametrize(
    ("seconds", "words"), [(42, "42 s"), (200, "3 min 20 s"), (7500.4, "2 h 5 min"), (59.7, "1 min 0 s")]
)
def test_durations_in_words(seconds: float, words: str) -> None:
    assert widgets.duration(seconds) == words


def test_with_ctrl_the_keys_of_flight_are_commands(desk: Desk) -> None:
    eye = desk.session.camera.eye.copy()
    desk.key(imgui.Key.q, control=True)
    assert (desk.session.camera.eye == eye).all()


def test_keys_typed_into_a_field_are_text(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.frames()
    desk.ui.io.add_key_event(imgui.Key.mod_ctrl, True)
    desk.click(*where["exposure"])
    desk.ui.io.add_key_event(imgui.Key.mod_ctrl, False)
    desk.frames(2)
    assert desk.ui.io.want_text_input
    desk.key(imgui.Key.space)
    desk.ui.io.add_input_characters_utf8("3.5")
    desk.key(imgui.Key.enter)
    assert desk.session.running
    assert desk.session.display.exposure == 3.5


def test_a_picture_of_the_view_is_saved_where_one_says(
    desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As large as the view, under the next free name, unless something else is typed."""
    monkeypatch.chdir(tmp_path)
    desk.key(imgui.Key.p, control=True)
    desk.frames(3)
    desk.key(imgui.Key.escape)
    assert not desk.requests and not imgui.is_popup_open("", ANY_POPUP)
    desk.key(imgui.Key.p, control=True)
    desk.frames(3)
    desk.key(imgui.Key.enter)
    assert desk.requests == [Request.SAVE_PICTURE] and desk.ui.state.picture is not None
    path, size = desk.ui.state.picture.path, desk.ui.state.picture.size
    assert path.parent == tmp_path and path.suffix == ".png"
    assert size == desk.ui.view_rect[2:]
    path.write_bytes(b"")
    assert free_name(tmp_path, path.stem, ".png") == tmp_path / f"{path.stem}-2.png"
    assert free_name(tmp_path, path.stem, ".exr") == tmp_path / f"{path.stem}.exr"


def test_how_far_a_picture_is_is_shown_and_it_can_be_stopped(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.ui.state.saving = saving = Saving("a.png", 0.25)
    desk.frames(3)
    assert imgui.is_popup_open("", ANY_POPUP) and desk.ui.moving and not saving.stopped
    desk.click(*where["Cancel"])
    assert saving.stopped
    desk.ui.state.saving = None
    desk.frames(2)
    assert not imgui.is_popup_open("", ANY_POPUP) and not desk.ui.moving


@pytest.mark.parametrize("key", [imgui.Key.p, imgui.Key.s], ids=["picture", "session"])
def test_the_folder_of_a_file_is_chosen_from_a_list(
    desk: Desk, where: dict[str, tuple[float, float]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, key: imgui.Key
) -> None:
    """Over the dialog, which stays with the name; Esc closes one at a time."""
    (tmp_path / "holidays").mkdir()
    monkeypatch.chdir(tmp_path)
    texts: list[str] = []
    real = imgui.input_text
    monkeypatch.setattr(imgui, "input_text", lambda label, text, *m: (texts.append(text), real(label, text, *m))[1])
    desk.key(key, control=True)
    desk.frames(2)
    name = Path(texts[-1]).name
    browse = next(place for label, place in where.items() if "\uf07c" in label)
    desk.click(*browse)
    desk.ui.io.add_input_characters_utf8("holi")
    desk.frames(2)
    desk.key(imgui.Key.enter)
    desk.click(*where["folder"])
    assert Path(texts[-1]) == tmp_path / "holidays" / name
    desk.click(*browse)
    desk.key(imgui.Key.escape)
    assert imgui.is_popup_open("", ANY_POPUP), "only the list is closed"
    desk.key(imgui.Key.escape)
    assert not imgui.is_popup_open("", ANY_POPUP)


@pytest.mark.parametrize("size", [(640, 480), (1280, 720)])
def test_the_loading_bar_stays_within_the_view(
    gpu: Gpu, monkeypatch: pytest.MonkeyPatch, size: tuple[int, int]
) -> None:
    session = FakeSession()
    session.loading = SimpleNamespace(stage="unfolding charts and " * 5, fraction=0.4, cancel=lambda: None)
    desk = Desk(gpu, session, size)
    window = imgui.internal.find_window_by_name("##loading")
    left, _, width, _ = desk.ui.state.view_px
    assert left <= window.pos.x and window.pos.x + window.size.x <= left + width
    desk.release()


def test_a_scene_on_its_way_is_not_no_scene(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is in the view already: panels and status bar say that it is being opened."""
    said: list[str] = []
    for name, which in (("text_colored", 1), ("text_unformatted", 0)):
        real = getattr(imgui, name)
        monkeypatch.setattr(imgui, name, lambda *a, real=real, which=which: said.append(a[which]) or real(*a))
    session = FakeSession(opened=False)
    desk = Desk(gpu, session, (1280, 720))
    assert "no scene" in said and "opening" not in said
    session.loading = SimpleNamespace(stage="unfolding", fraction=0.4, cancel=lambda: None)
    said.clear()
    desk.frames()
    assert said.count("opening") > 3 and "no scene" not in said
    desk.release()


def test_the_pace_is_seen_and_changed(desk: Desk) -> None:
    """Auto: watch at first, then fast; a key takes the other."""
    desk.session.run.seconds = 0.5
    desk.key(imgui.Key.p)
    assert desk.ui.state.pace.pace == "fast", "it was watched"
    desk.key(imgui.Key.p)
    assert desk.ui.state.pace.pace == "watch"
    desk.ui.state.pace = Pace()
    desk.session.run.seconds = 2 * WATCH_SECONDS
    desk.key(imgui.Key.p)
    assert desk.ui.state.pace.pace == "watch", "it was fast"


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


@pytest.mark.parametrize(
    ("control", "button"), [("exposure", 0), ("Pause", 0), ("view", 0), ("view", 1), ("view", 2)], ids=str
)
def test_a_hand_holds_from_press_to_release(
    desk: Desk, where: dict[str, tuple[float, float]], control: str, button: int
) -> None:
    desk.frames()
    desk.point(*(where | {"view": VIEW})[control])
    desk.frames(2)
    assert not desk.ui.held, "to point is not to hold"
    desk.press(button, True)
    desk.frames(2)
    assert desk.ui.held, "though nothing moves"
    other = Ui(native_dialog=False)
    assert desk.ui.held and not other.held, "each asks its own context"
    other.release()
    desk.ui.use()
    desk.press(button, False)
    assert not desk.ui.held


def test_a_key_of_flight_holds_the_view(desk: Desk) -> None:
    desk.ui.io.add_key_event(imgui.Key.w, True)
    desk.frames(2)
    assert desk.ui.held and desk.ui.moving
    desk.ui.io.add_key_event(imgui.Key.w, False)
    desk.frames(2)
    assert not desk.ui.held and not desk.ui.moving


@pytest.mark.parametrize(("scale", "speed"), [(1.0, 0.4), (100.0, 5.0)])
def test_one_walks_through_a_large_world(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, scale: float, speed: float
) -> None:
    monkeypatch.setattr(desk.session.lightmap.space, "scale", scale, raising=False)
    desk.ui.io.add_key_event(imgui.Key.w, True)
    desk.frames(1)
    start = desk.session.camera.eye.copy()
    desk.frames(10, seconds=0.1)
    desk.ui.io.add_key_event(imgui.Key.w, False)
    assert np.linalg.norm(desk.session.camera.eye - start) == pytest.approx(speed, rel=1e-3), "in a second"


def test_an_error_becomes_a_toast(gpu: Gpu, where: dict[str, tuple[float, float]]) -> None:
    desk = Desk(gpu, FakeSession(), (1920, 1080))
    desk.session.options = ShootingOptions(form_factor="disc")

    def refuse(options: ShootingOptions) -> None:
        raise UserError("--discs 4: no such discs here")

    desk.session.set_options = refuse  # type: ignore[method-assign]
    desk.frames()
    x, y = where["discs"]
    desk.drag((x, y), (x + 40, y))
    assert [t.text for t in desk.ui.state.toasts] == ["--discs 4: no such discs here"]
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
    desk.front("Materials")
    desk.ui.state.material = 3  # the lamp
    monkeypatch.setattr(slider, "slide", lambda label, value, *_: 2 * value if label == "##strength" else value)
    desk.frames()
    (call,) = [c for c in desk.session.calls if c[0] == "set_material"]
    assert call[1] == 3
    np.testing.assert_allclose(call[2].emission, (34.0, 24.0, 8.0), rtol=1e-12)  # colour kept, strength doubled
    assert call[2].albedo == (0.78, 0.78, 0.78)


def test_the_sun_is_moved_and_the_sky_is_another(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(gpu, FakeSession(), (1920, 1400))
    desk.front("Lights")
    before = desk.session.scene.sky = Sky("clear", (1.0, 0.5, 0.2), 2.0, sun=Sun(100, 20))
    moved = {"##Sun azimuth": 230.0, "##sky strength": 3.0}
    with monkeypatch.context() as hand:
        hand.setattr(slider, "slide", lambda label, value, *_: moved.get(label, value))
        desk.frames(1)
    (sky,) = [call[1] for call in desk.session.calls if call[0] == "set_sky"]
    assert (sky.sun, sky.strength, sky.colour) == (Sun(230, 20), 3.0, before.colour)
    for index, kind in enumerate(("none", "uniform", "clear")):
        desk.session.read = FakeScene(**vars(desk.session.scene) | {"sky": before})
        chosen = {"##kind": index}
        monkeypatch.setattr(imgui, "combo", lambda label, now, *_, c=chosen: (label in c, c.get(label, now)))
        desk.frames(1)
        now = desk.session.scene.sky
        assert (now is None) if kind == "none" else now.kind == kind
    desk.release()


def test_a_lamp_that_was_switched_off_keeps_its_colour(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    desk.front("Materials")
    desk.ui.state.material = 3
    desk.session.display = desk.session.display.replace(quantities="radiometric")
    for strength in (0.0, 5.0):
        monkeypatch.setattr(slider, "slide", lambda label, value, *_, s=strength: s if label == "##strength" else value)
        desk.frames()
    np.testing.assert_allclose(desk.session.scene.materials[3].emission, (5.0, 5 * 12 / 17, 5 * 4 / 17), rtol=1e-12)


def test_editing_a_light_tells_the_session(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    lights = (Light("a", intensity=(4.0, 2.0, 1.0)), Light("b", "spot"))
    told: list[tuple[Light, ...]] = []
    desk.session.scene.lights = lights
    desk.session.set_lights = told.append  # type: ignore[attr-defined]
    desk.front("Lights")
    assert not told
    monkeypatch.setattr(slider, "slide", lambda label, value, *_: 2 * value if label == "##strength" else value)
    desk.frames(1)
    assert told[-1] == (replace(lights[0], intensity=(8.0, 4.0, 2.0)), lights[1])  # colour kept, strength doubled


def test_a_light_is_dragged_by_its_handle(desk: Desk) -> None:
    """In the plane that faces the eye, and the view stays."""
    light = Light("a", position=tuple((desk.session.camera.eye + desk.session.camera.forward).tolist()))
    desk.session.scene.lights = (light,)

    def follow(lights: tuple[Light, ...]) -> None:
        desk.session.scene.lights = lights

    desk.session.set_lights = follow  # type: ignore[attr-defined]
    eye = desk.session.camera.world_from_camera.copy()
    left, top, width, height = desk.ui.state.view_px
    x, y = left + width / 2, top + height / 2
    desk.drag((x, y), (x + 100, y))
    moved = np.subtract(desk.session.scene.lights[0].position, light.position)
    assert moved == pytest.approx([2 * np.tan(desk.session.camera.yfov / 2) * 100 / height, 0, 0], rel=0.05)
    assert (desk.session.camera.world_from_camera == eye).all()


@pytest.mark.parametrize("solver", list(SOLVERS))
def test_lamps_flicker_where_the_solver_can_follow(desk: Desk, monkeypatch: pytest.MonkeyPatch, solver: str) -> None:
    desk.session.family = replace(desk.session.family, relights=SOLVERS[solver].relights)
    desk.front("Lights")
    monkeypatch.setattr(imgui, "checkbox", lambda label, on: (label == "##flicker", True))
    desk.frames(1)
    assert (("set_flicker", True) in desk.session.calls) == (solver in ("gathering", "local"))


# -- the rest ----------------------------------------------------------------------------------------------------------


def test_screenshots_are_numbered(desk: Desk, tmp_path: Path) -> None:
    state = desk.ui.state
    for folder in (tmp_path, tmp_path, tmp_path / "nowhere"):
        save_screenshot(desk.target, SIZE, folder, state)
    names = ["glowtree-0001.png", "glowtree-0002.png"]
    assert sorted(file.name for file in tmp_path.iterdir()) == names
    *saved, failed = state.toasts
    assert [toast.text for toast in saved] == [f"saved {tmp_path / name}" for name in names]
    assert failed.error and "nowhere" in failed.text and "cannot be written" in failed.text


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
    ("value", "text"),
    [(0, "0"), (17812345.6, "17,812,346"), (0.012345, "0.01235"), (1e-9, "1.000e-09"), (34.6, "34.60")],
)
def test_numbers_are_short(value: float, text: str) -> None:
    assert widgets.number(value) == text


def test_what_an_edit_releases_was_drawn_before(gpu: Gpu) -> None:
    """Another solver takes the pictures of the one before away, which are in the frame that it was chosen in."""
    session = FakeSession(gpu=gpu)
    session.image = image = gpu.texture((8, 4), 4, "f1")
    desk = Desk(gpu, session)
    desk.frames(2)

    def choose() -> None:
        session.image = None
        image.release()

    desk.ui.state.act(choose)
    desk.frames(2)
    assert session.image is None
    desk.release()
