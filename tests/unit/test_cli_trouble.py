"""The command line where the machine is in the way: folders that cannot be written, light that breaks, Ctrl-C at once."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from PIL import Image
from processes import started

import app.viewer.window
from app.cli import run
from app.solvers.shooting.solver import Shooting

ROOT = Path(__file__).parent.parent.parent
NOWHERE = os.devnull + "/home"  # cannot be made, even by root
NO_HOME = {"HOME": NOWHERE, "XDG_CONFIG_HOME": NOWHERE + "/.config", "XDG_CACHE_HOME": NOWHERE + "/.cache"}
posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has other folders and no SIGINT for one process")


@posix
@pytest.mark.parametrize("writable", [True, False])
def test_the_layout_is_kept_where_it_can_be(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, writable: bool
) -> None:
    given: dict[str, Any] = {}
    monkeypatch.setattr(app.viewer.window, "no_display", lambda: None)
    monkeypatch.setattr(
        app.viewer.window,
        "run_window",
        lambda make_session, **named: given.update(named) or app.viewer.window.Shown(0, 0.0, 1.0),
    )
    home = {"HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path / "new" / "config")}
    for name, value in (home if writable else NO_HOME).items():
        monkeypatch.setenv(name, value)
    assert run(["view", "furnace"]) == 0
    err = capsys.readouterr().err
    if writable:
        assert err == "" and given["layout_file"].parent.is_dir()
    else:
        assert given["layout_file"] is None
        assert len(err.splitlines()) == 1 and "layout" in err and NOWHERE in err


@posix
def test_charts_are_found_without_a_folder_to_keep_them(tmp_path: Path) -> None:
    """A cylinder: xatlas unfolds it, and its answer cannot be kept."""
    ring = [(np.cos(a), np.sin(a)) for a in np.linspace(0, 2 * np.pi, 12, endpoint=False)]
    corners = "".join(f"v {x:.4f} {y} {z:.4f}\n" for y in (0, 1) for x, z in ring)
    sides = "".join(f"f {i + 1} {(i + 1) % 12 + 1} {(i + 1) % 12 + 13} {i + 13}\n" for i in range(12))
    (tmp_path / "round.obj").write_text(corners + sides)
    done = subprocess.run(
        [sys.executable, "-m", "app", "info", "round.obj", "--light", "--json"],
        env={**os.environ, **NO_HOME, "PYTHONPATH": str(ROOT)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "xatlas" in json.loads(done.stdout)["unfolded_by"]


def poison(monkeypatch: pytest.MonkeyPatch, texture: str, call: int) -> None:
    """The ``call``-th batch of shots writes NaN to one texel that covers a surface."""
    work, calls = Shooting.work, []

    def poisoned(solver: Shooting, amount: int, bands: int = 1) -> Generator[None, None, int]:
        made = yield from work(solver, amount, bands)
        calls.append(made)
        if len(calls) == call:
            lightmap, pool = solver.lightmap, solver.lightmap.pool
            tile, y, x = np.argwhere(pool.surfaces.face >= 0)[100]
            at = tile % pool.columns * pool.tile + x, tile // pool.columns * pool.tile + y
            lightmap.texture(texture).write(np.full(4, np.nan, "f4").tobytes(), viewport=(*map(int, at), 1, 1))
        return made

    monkeypatch.setattr(Shooting, "work", poisoned)


@pytest.mark.parametrize(
    ("texture", "call", "shots"), [("t_irradiance", 1, 8), ("t_residual", 1, 8), ("t_residual", 2, 400)]
)
@pytest.mark.parametrize("kind", ["bake", "shot"])
def test_light_that_breaks_is_one_line_and_what_is_there_is_kept(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    kind: str,
    texture: str,
    call: int,
    shots: int,
) -> None:
    """In the last batch, where no shot follows that would notice, and before."""
    poison(monkeypatch, texture, call)
    output = tmp_path / ("a.png" if kind == "shot" else "out")
    size = ["--size", "64x48"] if kind == "shot" else ["--solver", "shooting"]
    line = [kind, "cornell-box", "-o", str(output), "--texels", "2000", "--residual", "1e-9", "--shots", str(shots)]
    assert run([*line, *size]) == 2
    out, err = capsys.readouterr()
    (said,) = (one for one in err.splitlines() if "note: texels: too few" not in one)
    assert out == "" and "the light is not finite after" in said and str(output) in said
    if kind == "shot":
        assert Image.open(output).size == (64, 48)
        return
    report = json.loads((output / "report.json").read_text())
    assert report["shots"] > 0 and f"all texels but {report['texels_not_finite']}" in said
    assert report["texels_not_finite"] == 1 or texture == "t_residual"
    image = OpenEXR.File(str(output / "irradiance.exr")).channels()["RGB"].pixels
    assert np.isfinite(image).all()
    assert image.max() > 0 or shots > 8  # one shot of what is no number reaches all


@pytest.mark.parametrize("found", [True, False])
def test_the_context_decides_what_doctor_misses(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], found: bool
) -> None:
    """``find_library`` needs ldconfig or a compiler: where both lack it finds nothing that is there."""
    monkeypatch.setattr("ctypes.util.find_library", lambda name: f"lib{name}.so" if found else None)
    assert run(["doctor"]) == 0
    assert capsys.readouterr().out.endswith("Everything that is needed is there.\n")


@posix
def test_ctrl_c_while_python_imports_is_one_line() -> None:
    line = [sys.executable, "-X", "importtime", "-m", "app", "info", "cornell-box"]
    with started(line, {**os.environ, "PYTHONPATH": str(ROOT)}) as worker:
        assert worker.stderr is not None
        for said in worker.stderr:  # each is a module that has been imported
            if said.rstrip().endswith("numpy.exceptions"):
                break
        worker.send_signal(signal.SIGINT)
        out, err = worker.communicate(timeout=60)
    lines = [line for line in err.splitlines() if not line.startswith("import time:")]
    assert worker.returncode == 130, err
    assert out == "" and lines == ["glowtree: stopped"]
