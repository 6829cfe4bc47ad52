"""Nothing outside of a family of solvers needs it: one that fills H with a constant is opened, switched to, solved, shown and
told of like any other."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from constant_solver import FAMILY, SWEEPS, Constant

from app.atlas.options import AtlasOptions
from app.cli import build_parser
from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.options import Options
from app.session.report import report, summary
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View
from app.solvers import SOLVERS, ShootingOptions
from app.viewer.picture import picture
from app.viewer.ui_frame import ui_image


@pytest.fixture
def constant(monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setitem(SOLVERS, "constant", FAMILY)
    return "constant"


def test_it_is_switched_to_while_another_runs(gpu: Gpu, constant: str) -> None:
    session = Session(gpu, options=ShootingOptions(resolution=64), atlas=AtlasOptions(texels=900))
    view = View(session)
    session.open_now("cornell-box")
    session.solve(Stop(work=16))
    shot = session.lightmap.irradiance()
    session.set_solver(constant)
    assert (session.lightmap.irradiance() == shot).all(), "its method begins with the light that is there"
    assert session.run.progress.done == 0 and session.solving
    session.solve(Stop())
    covered = session.lightmap.pool.surfaces.face >= 0
    np.testing.assert_allclose(session.lightmap.irradiance()[covered], 2.0, rtol=1e-6)
    assert session.run.converged and session.stats.unit == "sweeps" and session.stats.done == SWEEPS
    result = report(session)
    assert result["sweeps"] == SWEEPS and result["parameters"]["solver"] == constant
    assert f"{SWEEPS} sweeps" in summary(session, result) and "unswept" in summary(session, result)
    assert picture(view, (64, 48)).max() > 0
    assert ui_image(view, (640, 400), measured=False).max() > 0, "panels show its options"
    assert view.pick(32, 24) is None or view.pick(32, 24).facts  # type: ignore[union-attr]
    session.set_solver("shooting")
    assert session.lightmap.irradiance().max() == 0, "shooting must know what it has shot, and begins anew"
    session.solve(Stop(work=16))
    np.testing.assert_array_equal(session.lightmap.irradiance(), shot)
    view.release()
    session.release()


def test_flags_are_those_of_the_solver(constant: str) -> None:
    arguments = ["bake", "cornell-box", "-o", "x", "--solver", constant]
    flags = build_parser(constant).parse_args([*arguments, "--sweeps", "2", "--irradiance", "3"])
    assert flags.work == 2 and flags.irradiance == 3
    with pytest.raises(SystemExit):
        build_parser(constant).parse_args([*arguments, "--shots", "2"])


def test_a_solver_that_cannot_be_had_leaves_the_one_that_is_there(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuses(gpu: Gpu, lightmap: Lightmap, options: Options) -> Constant:
        raise UserError("not here")

    monkeypatch.setitem(SOLVERS, "broken", dataclasses.replace(FAMILY, make=refuses))
    session = Session(gpu, options=ShootingOptions(resolution=64), atlas=AtlasOptions(texels=900))
    session.open_now("furnace")
    session.solve(Stop(work=8))
    before = session.lightmap.irradiance()
    with pytest.raises(UserError, match="not here"):
        session.set_solver("broken")
    assert session.solver_name == "shooting"
    np.testing.assert_array_equal(session.lightmap.irradiance(), before)
    session.work(8)
    assert session.lightmap.irradiance().sum() > before.sum()
    session.release()


def test_a_family_that_cannot_begin_with_light_begins_without(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SOLVERS, "anew", dataclasses.replace(FAMILY, keeps_light=False))
    session = Session(gpu, options=ShootingOptions(resolution=64), atlas=AtlasOptions(texels=900))
    session.open_now("furnace")
    session.solve(Stop(work=8))
    session.set_solver("anew")
    assert not session.lightmap.irradiance().any()
    session.release()
