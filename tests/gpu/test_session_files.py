"""Files of sessions that are none, and what is put aside in case of a crash."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from places import Place, edit, place

from app.errors import UserError
from app.session import keeping as module
from app.session.keeping import Keeping, check_session, drop
from app.util.state_file import read_state, write_state

__all__ = ["place"]

# -- files that are none -----------------------------------------------------------------------------------------------


BAD = {
    "camera": {"world_from_camera": [[1, 0, 0, 0], [0, 2, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "yfov": 1, "distance": 1},
    "materials": [{"name": "x", "index": 0, "albedo": [2, 0, 0]}],
    "lights": [{"name": "x"}],
    "bookmarks": {"12": {}},
    "settings": {"gathering": {"noize": 1}},
    "scene": {"source": 3},
    "sky": {"kind": "clear", "colour": [1, 1, 1], "strength": 1, "turbidity": 3},
    "more": 1,
}


@pytest.mark.parametrize("key", BAD)
def test_malformed_documents_are_one_line(place: Callable[..., Place], tmp_path: Path, key: str) -> None:
    one = place().open("cornell-box")
    file = one.save(tmp_path / "a.glow")
    state = read_state(file)
    document = json.loads(state.values["document"])
    state.values["document"] = json.dumps(document | {key: BAD[key]})
    write_state(file, state)
    before = one.session.unedited
    with pytest.raises(UserError) as caught:
        one.keeping.open(one.view, file)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{file}: ") and key in line and len(line) < 300
    assert one.session.loading is None and one.session.unedited is before


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"{}", 4096 * b"\xff"])
def test_what_is_no_session_is_one_line(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "a.glow"
    file.write_bytes(content)
    with pytest.raises(UserError) as caught:
        check_session(file)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{file}: ")


def test_a_file_cut_short_anywhere_is_one_line(place: Callable[..., Place], tmp_path: Path) -> None:
    one = place().open("cornell-box")
    one.session.work(4)
    whole = one.save(tmp_path / "a.glow").read_bytes()
    cut = tmp_path / "cut.glow"
    for share in np.linspace(0.05, 0.999, 12):
        cut.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(UserError):
            check_session(cut)


# -- crashes -----------------------------------------------------------------------------------------------------------


def test_after_a_crash_one_can_go_on(
    place: Callable[..., Place], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "aside"
    monkeypatch.setattr(module, "EVERY_SECONDS", 0.0)
    first = place(folder).open("cornell-box")
    first.keeping._due = 0.0
    first.frame()
    assert not folder.exists() or not list(folder.glob("*.glow")), "nothing is to be lost yet"
    first.session.set_material(1, dataclasses.replace(first.session.materials[1], albedo=(0.1, 0.2, 0.3)))
    first.session.work(8)
    first.keeping._due = 0.0
    first.frame()
    assert first.keeping._writer is not None
    first.keeping._writer.join()
    (file,) = folder.glob("*.glow")
    assert Keeping(folder).asides() == [], "it lives"
    crashed = file.with_name("99999999.glow")  # as if another process had written it, and died
    file.rename(crashed)

    second = place(folder)
    (aside,) = second.keeping.asides()
    assert aside.name == "Cornell box" and aside.file == crashed
    assert Keeping(folder).asides() == [], "somebody looks at it already"
    second.keeping.go_on(second.view, aside)
    second.frames_until(lambda: second.session.on_its_way is None)
    second.frame()
    assert second.notes == [] and second.session.materials[1].albedo == (0.1, 0.2, 0.3)
    for one in (first, second):
        one.session.run.settle()
    assert second.session.solver.issued == first.session.solver.issued > 0
    assert second.keeping.path is None
    assert file.exists() and not crashed.exists(), "kept until it is saved, as one's own"
    second.keeping.end()
    assert not list(folder.glob("*.glow"))


def test_a_session_that_is_dropped_is_gone(place: Callable[..., Place], tmp_path: Path) -> None:
    one = place().open("cornell-box")
    (tmp_path / "aside").mkdir()
    one.save(tmp_path / "aside" / "1.glow")
    (aside,) = Keeping(tmp_path / "aside").asides()
    drop(aside)
    assert list((tmp_path / "aside").iterdir()) == []


def test_what_is_saved_is_not_put_aside(place: Callable[..., Place], tmp_path: Path) -> None:
    folder = tmp_path / "aside"
    one = place(folder).open("cornell-box")
    edit(one)
    one.save(tmp_path / "a.glow")
    one.keeping._due = 0.0
    one.frame()
    assert one.keeping._writer is None
