"""The viewer's window as ``glowtree shot --ui`` draws it, against a picture in screenshots/.

Compared on the software rasteriser only; elsewhere the picture must be there and not blank. A failure leaves picture
and difference in tests/screenshots/failed. ``pytest --regenerate-screenshots`` is the only way to change a golden.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from PIL import Image

from app.gpu import gpu_context
from app.lightmap.options import LightmapOptions
from app.options import Options
from app.render.options import DisplayOptions
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View
from app.solvers import GatheringOptions, ShootingOptions
from app.viewer.ui_frame import ui_image

ROOT = Path(__file__).parent.parent.parent
FAILED = Path(__file__).parent / "failed"
SIZE = (1280, 720)
SHOTS, RAYS = 1000, 256
STEP = 8  # of 255: what the last bit of a float does to a pixel after exposure and tone curve
SHARE = (
    0.005  # of the pixels may differ by more: a digit of a number that stands on the edge of rounding, a line of a plot
)
MAGNIFIED = 8


CLICK = (560, 480)  # on the floor


class Golden(NamedTuple):
    light: LightmapOptions = LightmapOptions()
    display: DisplayOptions = DisplayOptions()
    solver: str = "shooting"
    options: Options = ShootingOptions()
    work: int = SHOTS
    click: tuple[float, float] | None = None


GOLDENS = {
    "viewer": Golden(),
    "viewer-quadtree": Golden(LightmapOptions(adaptive=True), DisplayOptions(grid=True)),
    "viewer-rays": Golden(solver="gathering", options=GatheringOptions(noise=1e-3), work=RAYS, click=CLICK),
}


@pytest.mark.parametrize("name", GOLDENS)
def test_the_viewer_looks_as_it_did(request: pytest.FixtureRequest, name: str) -> None:
    golden = ROOT / "screenshots" / f"{name}.png"
    kind = GOLDENS[name]
    with gpu_context() as gpu:
        session = Session(gpu, solver=kind.solver, options=kind.options, light=kind.light, expose_on_open=True)
        view = View(session, kind.display)
        session.open_now("cornell-box")
        session.solve(Stop(work=kind.work))
        image = ui_image(view, SIZE, measured=False, click=kind.click)
        view.release()
        session.release()
        software = gpu.software
    assert image.shape == (SIZE[1], SIZE[0], 3)
    middle = image[100:450, 400:880]
    assert middle.std() > 10 and middle.max() > 150  # a lit box, not a blank
    if not software:
        pytest.skip("goldens are compared on the software rasteriser only")
    if request.config.getoption("--regenerate-screenshots"):
        Image.fromarray(image).save(golden)
    difference = np.abs(image.astype(int) - np.asarray(Image.open(golden).convert("RGB"), int)).max(axis=-1)
    wrong = float((difference > STEP).mean())
    if wrong > SHARE:
        FAILED.mkdir(exist_ok=True)
        Image.fromarray(image).save(FAILED / golden.name)
        magnified = np.clip(difference * MAGNIFIED, 0, 255).astype(np.uint8)
        Image.fromarray(magnified).save(FAILED / f"{golden.stem}-difference.png")
    assert wrong <= SHARE, f"{wrong:.2%} of the pixels differ: see {FAILED}"
