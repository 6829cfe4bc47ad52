"""Nothing outside of a family of solvers needs it: one that fills H with a constant is opened, switched to, solved, shown and
told of like any other."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from app.atlas.options import AtlasOptions
from app.cli import build_parser
from app.commands.report import report, summary
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.options import Options, option
from app.scene.model import Material
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View
from app.solvers import SOLVERS, EnergyBalance, Family, Inspection, Progress, ShootingOptions
from app.viewer.picture import picture
from app.viewer.ui_frame import ui_image

SWEEPS = 3


@dataclass(frozen=True)
class ConstantOptions(Options):
    irradiance: float = option(2.0, "of every texel", unit="W/m²", minimum=0, maximum=100)
    rest: float = option(0.5, "converged when so little remains", minimum=0.01, maximum=1)


class Constant:
    """Fills H with a constant; each sweep halves what it says remains."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, options: ConstantOptions) -> None:
        self.options, self._lightmap, self.issued = options, lightmap, 0

    def reset(self) -> None:
        self._lightmap.clear()
        self.issued = 0

    def set_options(self, options: ConstantOptions) -> None:
        self.options = options

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        self._lightmap.set_materials(materials)
        self.reset()

    def work(self, amount: int, bands: int = 1) -> Generator[None, None, int]:
        self._lightmap.light_target.clear(*[self.options.irradiance / self._lightmap.unit] * 3, 0.0)
        self.issued += 1
        yield
        return 1

    def poll(self, *, wait: bool = False) -> Progress:
        remaining = 0.5**self.issued
        return Progress(self.issued, remaining, np.zeros(3), remaining <= self.options.rest**SWEEPS)

    def settle(self) -> Progress:
        return self.poll(wait=True)

    def energy(self) -> EnergyBalance:
        E, nothing = self._lightmap.emitted, np.zeros(3)
        return EnergyBalance(
            E, E if self.issued else nothing, nothing, nothing if self.issued else E, nothing + 0.5, 1.0
        )

    @property
    def resolved(self) -> Mapping[str, Any]:
        return {}

    def inspect(self, texel: tuple[int, int] | None = None, *, images: bool = False) -> Inspection:
        return Inspection(texel_facts={} if texel is None else {"Constant": f"{self.options.irradiance}"})

    def passes(self, amount: int) -> dict[str, Callable[[], None]]:
        return {}

    def warm_up(self) -> Iterator[None]:
        yield

    def release(self) -> None:
        pass


@pytest.fixture
def constant(monkeypatch: pytest.MonkeyPatch) -> str:
    row = Family("Constant", "all alike", ConstantOptions, Constant, "sweeps", "unswept", 1, "rest", keeps_light=True)
    monkeypatch.setitem(SOLVERS, "constant", row)
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
