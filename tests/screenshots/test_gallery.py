"""The gallery: pictures of the scenes as ``glowtree shot`` draws them, against those in screenshots/.

Compared on the software rasteriser only, whose arithmetic is the same everywhere; elsewhere the picture must be there,
finite and not blank. A failure leaves picture and magnified difference in tests/screenshots/failed.
``pytest --regenerate-screenshots`` is the only way to change a golden.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.options import Options
from app.render.options import DisplayOptions
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View
from app.solvers import SOLVERS, ShootingOptions
from app.viewer.picture import picture

ROOT = Path(__file__).parent.parent.parent
GOLDENS = ROOT / "screenshots"
FAILED = Path(__file__).parent / "failed"
WIDE, SQUARE = (640, 360), (400, 400)
STEP = 3  # of 255: rounding to 8 bits, and what another LLVM's rounding of exp and log does after the tone curve
SHARE = 0.005  # of the pixels may differ by more: a texel whose visibility test was decided by the last bit of a float
MAGNIFIED = 8


@dataclass(frozen=True)
class Picture:
    """One golden. work: taken when so much has been done, in the solver's unit; None: at the end. exposure [EV]; None:
    automatic."""

    name: str
    work: int | None = None
    camera: int = 0
    exposure: float | None = None
    display: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Reel:
    """Pictures of one solve of one scene, in the order in which the light gets there; coarse enough to be quick. texels: 0 where
    a density [1/m] is given."""

    scene: str
    texels: int
    options: Options
    pictures: tuple[Picture, ...]
    size: tuple[int, int] = WIDE
    adaptive: bool = False
    solver: str = "shooting"
    density: float | None = None


GATHERING = SOLVERS["gathering"].options()
NIGHT_EV = -0.5  # lamps are far brighter than what they light
CORNELL_EV = 1.8  # automatic when solved; one for the whole series, so that it shows the light coming in
REELS = (
    Reel(
        "cornell-box",
        30_000,
        ShootingOptions(residual=1e-2),
        (
            Picture("light-after-20-shots", 20, exposure=CORNELL_EV),
            Picture("light-after-200-shots", 200, exposure=CORNELL_EV),
            Picture("layer-residual", 200, display={"layer": "residual"}),
            Picture("cornell-box", exposure=CORNELL_EV),
            Picture("layer-irradiance", display={"layer": "irradiance"}),
            Picture("layer-charts", display={"layer": "charts"}),
            Picture("layer-texels", display={"layer": "texels", "grid": True}),
        ),
        SQUARE,
    ),
    Reel(
        "cornell-box",
        2_000,
        ShootingOptions(residual=1e-2),
        (
            Picture("quadtree", 300, exposure=CORNELL_EV, display={"grid": True}),
            Picture("layer-leaves", 300, display={"layer": "leaves"}),
        ),
        SQUARE,
        adaptive=True,
    ),
    Reel(
        "cornell-box",
        1_500,  # few, so that it shows
        ShootingOptions(residual=1e-2),
        (Picture("bicubic", 200, exposure=CORNELL_EV, display={"interpolation": "bicubic"}),),
        SQUARE,
    ),
    Reel("textured-room", 60_000, ShootingOptions(level=3, residual=3e-2), (Picture("textured-room"),)),
    Reel(
        "two-rooms",
        16_000,
        ShootingOptions(coarsen=False),  # large patches would throw stripes through the door
        (
            Picture("two-rooms", 2500, exposure=4.0),  # for the dark room; automatic is for both
            Picture("false-colour-lux", 2500, camera=1, display={"false_colour": "illuminance"}),
        ),
    ),
    Reel("museum", 80_000, ShootingOptions(level=3), (Picture("museum", 700), Picture("museum-aisle", 700, camera=1))),
    Reel("grotto", 60_000, ShootingOptions(level=3), (Picture("grotto", 400, exposure=1.2),)),
    Reel(
        "cornell-box",
        30_000,
        GATHERING,
        (
            Picture("layer-direct", 128, exposure=CORNELL_EV, display={"layer": "direct"}),
            Picture("layer-indirect", 128, exposure=CORNELL_EV, display={"layer": "indirect"}),
            Picture("layer-expected-error", 128, display={"layer": "expected-error"}),
        ),
        SQUARE,
        solver="gathering",
    ),
    Reel("museum", 40_000, GATHERING, (Picture("museum-gathering", 320),), solver="gathering"),
    Reel("textured-room", 60_000, GATHERING, (Picture("textured-room-gathering", 128),), solver="gathering"),
    Reel("living-room", 40_000, GATHERING, (Picture("living-room", 64),), solver="gathering"),
    Reel(
        "village",
        0,
        SOLVERS["local"].options(patches=512, shadow_rays=16),
        (
            Picture("village", camera=3, exposure=NIGHT_EV),
            Picture("layer-local", camera=0, display={"layer": "local"}, exposure=NIGHT_EV),
        ),
        solver="local",
        density=1.0,
    ),
)


@pytest.mark.parametrize("reel", REELS, ids=lambda r: f"{r.solver}-{r.scene}-{r.texels}" + "-quadtree" * r.adaptive)
def test_the_gallery_looks_as_it_did(gpu: Gpu, reel: Reel, request: pytest.FixtureRequest) -> None:
    regenerate = request.config.getoption("--regenerate-screenshots")
    light = LightmapOptions(adaptive=reel.adaptive)
    atlas = AtlasOptions(texels=reel.texels) if reel.density is None else AtlasOptions(density=reel.density)
    session = Session(gpu, solver=reel.solver, options=reel.options, atlas=atlas, light=light)
    view = View(session)
    try:
        session.open_now(reel.scene)
        images = {taken.name: _taken(view, taken, reel.size) for taken in reel.pictures}
    finally:
        view.release()
        session.release()
    for name, image in images.items():
        assert image.shape == (reel.size[1], reel.size[0], 3)
        assert image.std() > 10 and image.max() > 100, f"{name} is blank"
    if not gpu.software:
        pytest.skip("goldens are compared on the software rasteriser only")
    wrong = {}
    for name, image in images.items():
        if regenerate:
            Image.fromarray(image).save(GOLDENS / f"{name}.png", optimize=True)
        share = _differing(name, image)
        if share > SHARE:
            wrong[name] = f"{share:.2%}"
    assert not wrong, f"so many pixels differ: {wrong}; see {FAILED}"


def _taken(view: View, taken: Picture, size: tuple[int, int]) -> np.ndarray[Any, Any]:
    view.look_through(view.session.scene.cameras[taken.camera])
    view.tell_observer()
    view.session.solve(Stop(work=taken.work))
    view.display = DisplayOptions(**taken.display)
    if taken.exposure is None:
        view.expose(size)
    else:
        view.display = view.display.replace(exposure=taken.exposure)
    return picture(view, size)


def _differing(name: str, image: np.ndarray[Any, Any]) -> float:
    """The share of pixels that differ from the golden; beyond SHARE, picture and difference are kept to look at."""
    golden = np.asarray(Image.open(GOLDENS / f"{name}.png").convert("RGB"), int)
    difference = np.abs(image.astype(int) - golden).max(axis=-1)
    share = float((difference > STEP).mean())
    paths = FAILED / f"{name}.png", FAILED / f"{name}-difference.png"
    if share > SHARE:
        FAILED.mkdir(exist_ok=True)
        Image.fromarray(image).save(paths[0])
        Image.fromarray(np.clip(difference * MAGNIFIED, 0, 255).astype(np.uint8)).save(paths[1])
    else:
        for stale in paths:
            stale.unlink(missing_ok=True)
    return share
