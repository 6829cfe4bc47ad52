"""Command lines that are tried: a folder of small files for them, good and bad, and what they print."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from app.cli import run

FILES = {
    "empty.glb": "",
    "short.glb": "glTF garbage",
    "noise.stl": "solid nothing",
    "a.xyz": "1 2 3",
    "points.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\n",
    "nan.obj": "v 0 0 0\nv 1 0 nan\nv 0 0 1\nf 1 2 3\n",
    "dark.obj": "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n",
    "room.obj": "".join(f"v {i & 1} {i >> 1 & 1} {i >> 2}\n" for i in range(8))
    + "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n",
    "nothing.toml": "[scene]\n",
    "syntax.toml": "[[quad]\n",
    "file": "",
    "walk.toml": "seconds = 1\n[[key]]\nposition = [0, 0, 0]\ntarget = [0, 0, 1]\n",
    "turned.toml": "seconds = 1\n[[key]]\nposition = [0, 0, 0]\ntarget = [0, 0, 0]\n",
    "typo.toml": "[[material]]\nname = 'a'\nalbedoo = 1\n",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory with the files of FILES, and without a screen."""
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "folder.png").mkdir()
    monkeypatch.chdir(tmp_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


def json_of(capsys: pytest.CaptureFixture[str], line: list[str]) -> dict[str, Any]:
    """What a command line prints with --json."""
    assert run(line) == 0
    values = json.loads(capsys.readouterr().out)
    assert isinstance(values, dict)
    return values
