"""Files in the interface: saved and opened by keys, menus and dialogs; recent ones; quitting with a question; after a crash."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
from desks import Desk, desk, session, where
from imgui_bundle import imgui

from app.session.keeping import WORTH_SECONDS, Aside
from app.session.settings import checked, settings_of
from app.ui import recovery, settings
from app.ui.keys import ANY_POPUP
from app.ui.state import Request
from app.util.recent import MOST, Recent

__all__ = ["desk", "session", "where"]


class FakeKeeping:
    """Takes notes."""

    def __init__(self) -> None:
        self.path: Path | None = None
        self.calls: list[tuple[str, object]] = []
        self.worth = False

    def poll(self, view: object, tables: object, put: object) -> list[str]:
        return []

    def unsaved(self, view: object) -> bool:
        return self.worth

    def save(self, view: object, path: Path, tables: object) -> None:
        self.calls.append(("save", path))
        self.path, self.worth = path, False

    def open(self, view: object, path: Path) -> None:
        self.calls.append(("open", path))

    def go_on(self, view: object, aside: Aside) -> None:
        self.calls.append(("go on", aside))


@pytest.fixture
def keeping(desk: Desk) -> FakeKeeping:
    desk.ui.state.keeping = keeping = FakeKeeping()  # type: ignore[assignment]
    return keeping


def asking() -> bool:
    return bool(imgui.is_popup_open("", ANY_POPUP))


def type_name(desk: Desk, text: str) -> None:
    """Into the field that has the keyboard, in place of what is there."""
    desk.frames(2)
    desk.key(imgui.Key.a, control=True)
    desk.ui.io.add_input_characters_utf8(text)
    desk.frames(2)
    desk.key(imgui.Key.enter)


def test_save_asks_for_a_name_once(desk: Desk, keeping: FakeKeeping, tmp_path: Path) -> None:
    desk.key(imgui.Key.s, control=True)
    assert asking()
    type_name(desk, str(tmp_path / "mine"))
    assert keeping.calls == [("save", tmp_path / "mine.glow")] and not asking()
    assert [t.text for t in desk.ui.state.toasts] == [f"saved {tmp_path / 'mine.glow'}"]
    desk.key(imgui.Key.s, control=True)
    assert len(keeping.calls) == 2 and not asking()
    desk.ui.io.add_key_event(imgui.Key.mod_shift, True)
    desk.key(imgui.Key.s, control=True)
    desk.ui.io.add_key_event(imgui.Key.mod_shift, False)
    assert asking()
    desk.key(imgui.Key.escape)
    assert not asking() and len(keeping.calls) == 2


def test_no_name_is_taken_where_nothing_can_be_saved(desk: Desk, keeping: FakeKeeping, tmp_path: Path) -> None:
    desk.key(imgui.Key.s, control=True)
    for text in (str(tmp_path), str(tmp_path / "no" / "such"), "  "):
        type_name(desk, text)
        assert asking() and not keeping.calls
        desk.key(imgui.Key.escape)
        desk.key(imgui.Key.s, control=True)
    desk.key(imgui.Key.escape)


@pytest.mark.parametrize("known", [True, False])
def test_quit_and_save(
    desk: Desk, keeping: FakeKeeping, where: dict[str, tuple[float, float]], tmp_path: Path, known: bool
) -> None:
    keeping.worth, keeping.path = True, tmp_path / "a.glow" if known else None
    desk.key(imgui.Key.q, control=True)
    desk.frames(2)
    desk.click(*where["Save"])
    if not known:
        assert asking() and desk.requests == []
        type_name(desk, str(tmp_path / "a.glow"))
    assert keeping.calls == [("save", tmp_path / "a.glow")] and desk.requests == [Request.QUIT]


def test_whoever_does_not_name_a_file_stays(
    desk: Desk, keeping: FakeKeeping, where: dict[str, tuple[float, float]], tmp_path: Path
) -> None:
    keeping.worth = True
    desk.key(imgui.Key.q, control=True)
    desk.frames(2)
    desk.click(*where["Save"])
    desk.key(imgui.Key.escape)
    assert not asking()
    desk.key(imgui.Key.s, control=True)
    type_name(desk, str(tmp_path / "a.glow"))
    assert len(keeping.calls) == 1 and desk.requests == [], "that was another wish"


def test_edits_alone_are_worth_a_question(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.frames()
    state, session = desk.ui.state, desk.session
    assert not state.keeping.unsaved(session)
    session.seconds = 2 * WORTH_SECONDS
    assert state.keeping.unsaved(session)
    session.seconds = 1.0
    session.set_material(0, session.materials[1])
    assert state.keeping.unsaved(session)


def test_files_are_opened_by_kind(desk: Desk, keeping: FakeKeeping) -> None:
    for name in ("a.glow", "b.exr", "c.glb"):
        desk.ui.drop(desk.session, Path(name))
        desk.frames()
    assert keeping.calls == [("open", Path("a.glow"))]
    assert desk.session.calls == [("open_reference", "b.exr"), ("open", "c.glb")]


# -- after a crash -----------------------------------------------------------------------------------------------------


@pytest.fixture
def aside(desk: Desk, tmp_path: Path) -> Aside:
    """What a crash has left, which is offered; its lock counts how often it is released."""
    file, released = tmp_path / "1.glow", list[bool]()
    file.touch()
    lock = SimpleNamespace(release=lambda: released.append(True), lock_file=str(tmp_path / "1.lock"), released=released)
    aside = Aside(file, "Cornell box", 200.0, 1.7e9, lock)  # type: ignore[arg-type]
    desk.ui.state.asides = [aside]
    return aside


def test_what_a_crash_has_left_is_offered_beside_the_scene_that_was_asked_for(
    desk: Desk, aside: Aside, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing stands over it: a line of the status bar asks where it is clicked."""
    places: list[imgui.ImVec2] = []

    def noting(colour: object, text: str) -> None:
        write(colour, text)
        if text.endswith(": go on?"):
            places.append(imgui.get_item_rect_min())

    write = imgui.text_colored
    monkeypatch.setattr(imgui, "text_colored", noting)
    desk.frames(3)
    assert not asking() and places and places[-1].y > desk.size[1] - 40
    desk.click(places[-1].x + 5, places[-1].y + 5)
    assert asking()
    desk.key(imgui.Key.escape)
    assert not asking() and desk.ui.state.asides == [aside]


@pytest.mark.parametrize("answer", ["Go on", "Drop it", "Later"])
def test_after_a_crash_one_is_asked(
    desk: Desk, keeping: FakeKeeping, aside: Aside, where: dict[str, tuple[float, float]], answer: str
) -> None:
    assert "Cornell box, solved for 3 min 20 s, of " in recovery.in_words(aside)
    desk.ui.state.recover = aside
    desk.frames(3)
    assert asking()
    desk.click(*where[answer.split(" ")[-1]])
    assert not asking() and desk.ui.state.recover is None
    assert keeping.calls == ([("go on", aside)] if answer == "Go on" else [])
    assert desk.ui.state.asides == ([aside] if answer == "Later" else [])
    assert aside.file.exists() == (answer != "Drop it")


def test_going_on_asks_where_what_is_open_would_be_lost(
    desk: Desk, keeping: FakeKeeping, aside: Aside, where: dict[str, tuple[float, float]]
) -> None:
    keeping.worth, desk.ui.state.recover = True, aside
    desk.frames(3)
    desk.click(*where["on"])
    desk.frames(2)
    assert asking() and keeping.calls == []
    desk.click(*where["Cancel"])
    assert desk.ui.state.asides == [aside], "it is still offered"


# -- settings and recent files -----------------------------------------------------------------------------------------


def test_settings_are_applied_as_one_edit(desk: Desk) -> None:
    session, state = desk.session, desk.ui.state
    before = session.options, session.display, state.pace
    given = {"shooting": {"residual": 0.5}, "display": {"tone_map": "aces"}, "pace": {"pace": "fast"}}
    settings.put(session, state, checked(given, "test", settings.KNOWN))
    desk.frames()
    assert (session.options.residual, session.display.tone_map, state.pace.pace) == (0.5, "aces", "fast")
    desk.key(imgui.Key.z, control=True)
    assert (session.options, session.display, state.pace) == before and state.edits.undoable is None


def test_saved_settings_are_those_of_the_window(desk: Desk, tmp_path: Path) -> None:
    desk.session.options = desk.session.options.replace(residual=0.25)
    desk.ui.state.ask_for_settings_name = True
    desk.frames(2)
    type_name(desk, str(tmp_path / "mine"))
    read = settings_of(tmp_path / "mine.toml", settings.KNOWN)
    assert read.solver == desk.session.chosen_solver and read.tables["shooting"]["residual"] == 0.25
    assert read.tables["pace"]["pace"] == "auto"


def test_recent_files(tmp_path: Path) -> None:
    file, scenes = tmp_path / "state" / "recent.json", [tmp_path / f"{index}.glb" for index in range(MOST + 3)]
    for scene in scenes:
        scene.touch()
        Recent(file).add(scene)
    assert Recent(file).paths == scenes[: -MOST - 1 : -1]
    recent = Recent(file)
    recent.add(scenes[5])
    assert Recent(file).paths[0] == scenes[5] and len(recent.paths) == MOST
    scenes[5].unlink()
    assert scenes[5] not in recent.paths, "what is gone is not offered"
    recent.forget()
    assert Recent(file).paths == []
    for content in (b"\xff", b"{}", b'[1, "a\\u0000b"]', b"[" * 60000):
        file.write_bytes(content)
        assert Recent(file).paths == []
    Recent(tmp_path / "0.glb" / "no folder").add(scenes[1])  # nothing to be done about it


# -- bookmarks of the camera -------------------------------------------------------------------------------------------


def test_a_digit_goes_where_it_was_set(desk: Desk) -> None:
    start = desk.session.camera.world_from_camera.copy()
    desk.key(imgui.Key._3)
    assert "no bookmark 3" in desk.ui.state.toasts[-1].text
    desk.key(imgui.Key._3, control=True)
    desk.drag((640, 260), (700, 300))
    moved = desk.session.camera.world_from_camera.copy()
    assert not (moved == start).all()
    desk.key(imgui.Key._3)
    assert (desk.session.camera.world_from_camera == start).all()
    assert desk.session.camera is not desk.session.bookmarks[3], "what moves on is not the bookmark"
    desk.key(imgui.Key.z, control=True)
    assert (desk.session.camera.world_from_camera == moved).all(), "a jump is undone"
    assert desk.ui.state.keeping.unsaved(desk.session), "they are kept in the session"


def test_digits_that_are_typed_are_text(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.frames()
    desk.ask_to_type(*where["exposure"])
    desk.key(imgui.Key._3)
    assert desk.ui.state.toasts == []
