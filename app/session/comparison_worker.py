"""A reference solved in a process of its own: ``python -m app.session.comparison_worker in.pickle out.npz``.

in.pickle: ``scene``, ``atlas`` (AtlasOptions) and ``residual``, written by comparison_solve.py. Standard
output gets lines of the share done and what is being done. out.npz: image (h, w, 3) f32, irradiance [W/m²], gutters filled; of
each side triangle, back, and uv (f, 3, 2) [texels of the image]; texels; unshot, of the emitted power.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import sys
import threading
from pathlib import Path

import numpy as np

from app.errors import UserError
from app.gpu import gpu_context
from app.lightmap.collapse import collapse
from app.lightmap.seams import finished
from app.session.run import Stop
from app.session.session import Session
from app.session.stats import Stats
from app.solvers import ShootingOptions

LOADING = 0.1  # of the bar, which is then for shooting
NICENESS = 5  # the window goes first
INTERRUPTED = 130  # what shells call a program that Ctrl-C ended


def solve(source: Path, target: Path) -> int:
    """The exit code: an interrupted solve is no answer, and not written. Raises UserError."""
    given = pickle.loads(source.read_bytes())
    with gpu_context() as gpu:
        session = Session(gpu, options=ShootingOptions(residual=given["residual"]), atlas=given["atlas"])
        session.open_now(given["scene"], lambda stage, share: say(stage, LOADING * share))
        stop = Stop()

        def tell(stats: Stats) -> None:
            done = f"{session.family.words(stats.done)}, {stats.remaining:.3%} {stats.remains}"
            say(done, LOADING + (1 - LOADING) * session.run.share_done(stop))

        session.solve(stop, tell)
        if session.run.interrupted:
            return INTERRUPTED
        lightmap, charts = session.lightmap, session.charts
        lightmap.refresh_ambient(wait=True)
        image = finished(*collapse(lightmap.pool, lightmap.irradiance(ambient=True)), lightmap.charts)
        answer = {
            "image": image,
            "triangle": charts.face_triangle,
            "back": charts.face_back,
            "uv": charts.face_uv * (image.shape[0] // charts.size[1]),
            "texels": np.array(lightmap.texel_count),
            "unshot": np.array(session.run.progress.remaining),
        }
        session.release()
    np.savez(target, **answer)
    return 0


def say(stage: str, share: float) -> None:
    """One line for whoever waits."""
    print(f"{share:.4f} {stage}", flush=True)


def end_with_parent() -> None:
    """Wait until whoever started this is gone, or has closed its end."""
    while os.read(sys.stdin.fileno(), 1):  # not through a buffer: its lock would be held when this process ends
        pass
    os._exit(1)


def main() -> int:
    with contextlib.suppress(AttributeError, OSError):  # systems without niceness
        os.nice(NICENESS)
    threading.Thread(target=end_with_parent, daemon=True).start()
    try:
        return solve(Path(sys.argv[1]), Path(sys.argv[2]))
    except UserError as error:
        print(error, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
