"""The list of files: typed paths, keys, what was opened lately; and what is said of a scene that waits."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from desks import Desk, desk, session
from fake_session import FakeSession
from imgui_bundle import imgui

from app.gpu import Gpu
from app.ui import overlays
from app.ui.file_list import FileList

__all__ = ["desk", "session"]

ANY = int(imgui.PopupFlags_.any_popup_id | imgui.PopupFlags_.any_popup_level)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current one."""
    for name in ("attic.glb", "barn.glb", "barn.toml", "cellar.obj"):
        (tmp_path / name).touch()
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "deep.glb").touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def asked(gpu: Gpu, folder: Path) -> Callable[[], Desk]:
    def ask() -> Desk:
        desk = Desk(gpu, FakeSession(), (900, 600))
        desks.append(desk)
        desk.key(imgui.Key.o, control=True)
        desk.frames(2)
        assert imgui.is_popup_open("", ANY)
        return desk

    desks: list[Desk] = []
    yield ask  # type: ignore[misc]
    for each in desks:
        each.release()


def typed(desk: Desk, text: str) -> None:
    desk.ui.io.add_input_characters_utf8(text)
    desk.frames(3)


def opened(desk: Desk) -> list[str]:
    return [str(call[1]) for call in desk.session.calls if call[0] == "open"]


@pytest.mark.parametrize(
    ("text", "file"),
    [
        ("{folder}/barn.glb", "barn.glb"),
        ("barn.toml", "barn.toml"),
        ("more/deep.glb", "more/deep.glb"),
        ("cel", "cellar.obj"),  # the only one
        ("more/../attic.glb", "attic.glb"),
    ],
)
def test_a_path_is_typed(asked: Callable[[], Desk], folder: Path, text: str, file: str) -> None:
    desk = asked()
    typed(desk, text.format(folder=folder))
    desk.key(imgui.Key.enter)
    (path,) = opened(desk)
    assert Path(path).resolve() == folder / file
    assert not imgui.is_popup_open("", ANY)


@pytest.mark.parametrize("text", ["barn", "nowhere/x.glb", "\x01~nobody/x", "x" * 5000])
def test_what_is_no_file_is_said_and_nothing_is_lost(asked: Callable[[], Desk], text: str) -> None:
    desk = asked()
    typed(desk, text)
    desk.key(imgui.Key.enter)
    assert opened(desk) == [] and imgui.is_popup_open("", ANY)
    assert "there is no file or folder" in desk.ui._files._scenes._list._trouble
    desk.key(imgui.Key.escape)
    assert not imgui.is_popup_open("", ANY)


def test_arrow_keys_and_enter_choose(asked: Callable[[], Desk], folder: Path) -> None:
    """Into a folder, and the second entry of it: the first leads out again."""
    desk = asked()
    for _ in range(2):
        desk.key(imgui.Key.down_arrow)
    desk.key(imgui.Key.enter)
    assert desk.ui._files._scenes._list.folder == folder / "more" and opened(desk) == []
    for key in (
        imgui.Key.down_arrow,
        imgui.Key.down_arrow,
        imgui.Key.down_arrow,
        imgui.Key.up_arrow,
        imgui.Key.down_arrow,
    ):
        desk.key(key)
    desk.key(imgui.Key.enter)
    assert opened(desk) == [str(folder / "more" / "deep.glb")]


def test_typing_narrows_the_list(asked: Callable[[], Desk], monkeypatch: pytest.MonkeyPatch) -> None:
    desk = asked()
    names: list[str] = []
    real = imgui.selectable
    monkeypatch.setattr(
        imgui,
        "selectable",
        lambda label, *more: names.append(label.split("###")[0].split("  ")[1]) or real(label, *more),
    )
    desk.frames()
    assert names == ["..", "more", "attic.glb", "barn.glb", "barn.toml", "cellar.obj"]
    typed(desk, "BARN")
    names.clear()
    desk.frames()
    assert names == ["..", "barn.glb", "barn.toml"]


def test_what_was_opened_lately_is_first(asked: Callable[[], Desk], folder: Path, gpu: Gpu) -> None:
    desk = asked()
    desk.key(imgui.Key.escape)
    for file in (folder / "more" / "deep.glb", folder / "gone.glb", folder / "barn.glb"):
        desk.ui.state.recent.add(file)
    desk.key(imgui.Key.o, control=True)
    desk.frames(2)
    for _ in range(2):
        desk.key(imgui.Key.down_arrow)
    desk.key(imgui.Key.enter)
    assert opened(desk) == [str(folder / "more" / "deep.glb")], "the second newest that is still there"


def test_a_scene_that_waits_says_so(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(overlays, "_in_the_middle", lambda text, state: said.append(text))
    desk.session.running = False
    desk.frames()
    assert said == [], "there is light already"
    desk.session.done = 0
    desk.frames()
    assert said == ["Paused: press Space to let light in"]
    desk.key(imgui.Key.space)
    said.clear()
    desk.frames()
    assert said == []


def test_a_folder_is_asked_for(folder: Path) -> None:
    files = FileList((), "", folders=True)
    files.begin(folder)
    assert [path.name for path in files._entries()] == ["more"]
    assert files._take(folder / "barn.glb") is None and "there is no folder" in files._trouble
    assert files._take(folder / "more") is None and files.folder == folder / "more"
