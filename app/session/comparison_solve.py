"""A finer solve of a scene, in a process of its own: the window goes on, and it can be stopped at any time.

Its answer is cached by what went in. See comparison_worker.py for the other end.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from app import __version__
from app.atlas.enclosed import cameras_inside
from app.atlas.options import AtlasOptions
from app.compare.reference_light import ReferenceLight
from app.errors import UserError
from app.scene.arrays import arrays_of
from app.scene.model import Scene
from app.util import cache
from app.util.background import Progress

WORKER = "app.session.comparison_worker"
POLL_S = 0.1
CACHE_FILES = 8  # kept, newest first
FORMAT = b"glowtree reference 1"  # changes when the worker's answer does
ANSWER = {"image", "triangle", "back", "uv", "texels", "unshot"}


def solved_light(scene: Scene, atlas: AtlasOptions, residual: float, tell: Progress) -> ReferenceLight:
    """From the cache or from a worker, which solves with closed forms and full storage until so little of the emitted power is
    unshot; ``tell`` may raise to stop it. Raises UserError."""
    knobs = repr((__version__, atlas, residual)).encode()
    path = cache.entry("reference", cache.digest(FORMAT + knobs, arrays_of(scene) | {"cameras": cameras_inside(scene)}))
    found = cache.read(path)
    if found is None or not found.keys() >= ANSWER:
        with tempfile.TemporaryDirectory(prefix="glowtree-") as folder:
            source, target = Path(folder) / "in.pickle", Path(folder) / "out.npz"
            source.write_bytes(pickle.dumps({"scene": scene, "atlas": atlas, "residual": residual}))
            _run_worker(source, target, tell)
            found = cache.read(target)
            if found is None:
                raise UserError("the reference could not be solved: nothing was written")
            cache.store(target.read_bytes(), path, CACHE_FILES)
    return _light(found, scene)


def _light(found: dict[str, Any], scene: Scene) -> ReferenceLight:
    return ReferenceLight(
        name="a finer solve",
        image=found["image"],
        triangle=found["triangle"],
        back=found["back"],
        uv=found["uv"],
        materials=scene.materials,
        texels=int(found["texels"]),
        unshot=float(found["unshot"]),
    )


def _run_worker(source: Path, target: Path, tell: Progress) -> None:
    """Whatever ends the wait ends the worker. It ends by itself, too, when its standard input is closed: with this process. In a
    session of its own it does not hear of Ctrl-C, which is for whoever waits."""
    root = str(Path(__file__).resolve().parents[2])
    path = os.pathsep.join(p for p in (root, os.environ.get("PYTHONPATH")) if p)
    command = [sys.executable, "-m", WORKER, str(source), str(target)]
    said, errors = source.with_name("said"), source.with_name("errors")
    with said.open("wb") as out, errors.open("wb") as err:
        worker = subprocess.Popen(
            command,
            env={**os.environ, "PYTHONPATH": path},
            stdin=subprocess.PIPE,
            stdout=out,
            stderr=err,
            start_new_session=True,
        )
        try:
            while worker.poll() is None:
                tell(*_progress(said))
                time.sleep(POLL_S)
        finally:
            worker.kill()
            worker.wait()
            assert worker.stdin is not None
            worker.stdin.close()
    if worker.returncode:
        lines = errors.read_text(errors="replace").strip().splitlines()
        why = lines[-1] if lines else f"exit code {worker.returncode}"
        raise UserError(f"the reference could not be solved: {why}")


def _progress(said: Path) -> tuple[str, float]:
    """The last whole line that the worker has said: share done, and what it does."""
    lines = said.read_text(encoding="utf-8", errors="replace").split("\n")[:-1]
    if not lines:
        return "starting", 0.0
    share, stage = lines[-1].split(" ", 1)
    return stage, float(np.clip(float(share), 0.0, 1.0))
