"""The visibility map's resolution follows the scene: about one sample for a texel as seen from afar."""

from __future__ import annotations

import pytest

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.session.session import Session
from app.solvers import ShootingOptions
from app.visibility.projections import PROJECTIONS


@pytest.fixture
def box(gpu: Gpu):
    session = Session(gpu)
    yield session
    session.release()


def opened(session: Session, texels: int, *, adaptive: bool = False) -> int:
    session.atlas, session.light = AtlasOptions(texels=texels), LightmapOptions(adaptive=adaptive)
    session.open_now("cornell-box")
    resolution: int = session.solver.resolved["resolution"]
    (image,) = session.solver.inspect(images=True).images.values()
    assert image.size == PROJECTIONS["hemicube"].size(resolution)
    return resolution


def test_it_follows_the_texels_between_two_bounds(box: Session) -> None:
    coarse, fine, finest = (opened(box, texels=texels) for texels in (2_000, 250_000, 1_000_000))
    texel = 1 / (box.charts.density * box.lightmap.space.scale)  # in units of half the diagonal
    assert coarse == 256 and finest == 512 < 2 / texel
    assert coarse < fine < finest and fine % 64 == 0


def test_a_tree_is_judged_by_the_texels_that_it_may_grow(box: Session) -> None:
    """Its roots are four times as wide as the uniform texels that light is shot from."""
    assert opened(box, texels=15_000, adaptive=True) == opened(box, texels=240_000)


def test_what_is_set_holds_and_is_reported(box: Session) -> None:
    box.set_options(ShootingOptions(resolution=128))
    assert opened(box, texels=2_000) == 128
    box.set_options(ShootingOptions())
    assert box.parameters["shooting"]["resolution"] == 256 == box.stats.resolved["resolution"]
