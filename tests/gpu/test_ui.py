"""The user interface, driven by injected events over a session that only takes notes: widgets, and the rest."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from desks import PICKED, SIZE, VIEW, Desk, desk, session, where
from fake_session import FakeSession
from imgui_bundle import imgui

from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.gpu import Gpu, ShaderError
from app.options import Options, specs
from app.render.options import DisplayOptions
from app.session.keeping import WORTH_SECONDS
from app.solvers import ShootingOptions
from app.ui import overlays, slider, widgets
from app.ui.app import Ui
from app.ui.file_list import readable
from app.ui.keys import ANY_POPUP
from app.ui.picture_dialog import free_name
from app.ui.state import WATCH_SECONDS, Legend, Pace, Request, Saving
from app.viewer.saving import save_screenshot

__all__ = ["desk", "session", "where"]


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


def test_a_lamp_that_was_switched_off_keeps_its_colour(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    desk.front("Materials")
    desk.ui.state.material = 3
    desk.session.display = desk.session.display.replace(quantities="radiometric")
    for strength in (0.0, 5.0):
        monkeypatch.setattr(slider, "slide", lambda label, value, *_, s=strength: s if label == "##strength" else value)
        desk.frames()
    np.testing.assert_allclose(desk.session.scene.materials[3].emission, (5.0, 5 * 12 / 17, 5 * 4 / 17), rtol=1e-12)


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
