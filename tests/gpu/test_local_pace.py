"""The local matrix in a window: its pieces of work in parts, edits in the middle of one, and options that cannot be had."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.gpu import Gpu
from app.session.run import Stop
from app.session.session import Session
from app.solvers.local.matrix import LocalMatrix
from app.solvers.local.options import LocalOptions
from app.solvers.local.solver import Local

MOST = 128


@pytest.fixture
def session(gpu: Gpu) -> Iterator[Session]:
    session = Session(
        gpu, solver="local", options=LocalOptions(patches=MOST, patch_level=0), atlas=AtlasOptions(texels=6000)
    )
    session.open_now("two-rooms")
    session.solve(Stop())
    yield session
    session.release()


def light_of_lamps(local: Local) -> np.ndarray:
    """RGB of all texels."""
    return np.frombuffer(local.direct.light.read(), np.float32).reshape(-1, 4)[:, :3].copy()


def filled(gpu: Gpu, bands: int, rng: np.random.Generator) -> np.ndarray:
    """A matrix that some nodes have entered, its updates added in so many parts."""
    matrix = LocalMatrix(gpu, MOST, "inverse", 32)
    albedos = np.zeros((MOST, 3))
    for slot in range(6):
        kernel = np.where(np.arange(MOST) < slot, rng.uniform(0.0, 0.1, MOST), 0.0)
        matrix.enter(slot, kernel, np.full(3, 0.5), albedos, np.zeros(MOST, bool))
        albedos[slot] = 0.5
    for _ in matrix.flush_in(bands):
        pass
    found = matrix.read()
    matrix.release()
    return found


@pytest.mark.parametrize("bands", [2, 3, 7])
def test_updates_in_parts_are_those_in_one(gpu: Gpu, bands: int) -> None:
    whole, parts = (filled(gpu, n, np.random.default_rng(5)) for n in (1, bands))
    assert np.abs(whole).max() > 0
    np.testing.assert_array_equal(parts, whole)


def test_an_edit_in_the_middle_of_a_piece_of_work_is_shown_by_its_end(session: Session) -> None:
    local = session.solver
    assert isinstance(local, Local)
    local.set_observer(np.array(session.scene.corners.reshape(-1, 3).max(0)))
    work, before, to_come = local.work(1), local.issued, local.to_come
    while local.to_come == to_come > 0:
        next(work)
    doubled = tuple(type(m)(m.name, m.albedo, emission=tuple(2.0 * e for e in m.emission)) for m in session.materials)
    direct = light_of_lamps(local)
    local.set_materials(doubled)
    assert next(work, "over") == "over" and 0 < local.issued - before < local.options.swaps, (
        "what was begun ended early"
    )
    np.testing.assert_allclose(light_of_lamps(local), 2 * direct, rtol=1e-5)


def test_rows_that_do_not_fit_lose_nothing(session: Session) -> None:
    light, options = session.lightmap.irradiance(), session.options
    with pytest.raises(UserError, match="--row-memory"):
        session.set_options(options.replace(row_memory=1, rays=1024, patches=256))
    assert session.options is options
    session.work()
    np.testing.assert_allclose(session.lightmap.irradiance(), light, rtol=1e-3, atol=1e-4)
