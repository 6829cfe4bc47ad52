"""Direct and indirect light of a bake apart: each where it belongs, and together the whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.bake.read import read_irradiance
from app.cli import run


def parts_of(folder: Path) -> list[np.ndarray]:
    return [read_irradiance(folder / f"irradiance{part}.exr") for part in ("", "-direct", "-indirect")]


@pytest.mark.parametrize("sky", ["", "--sky clear --sun 180,40"])
def test_parts_are_direct_and_indirect_light(tmp_path: Path, sky: str) -> None:
    """Also where the sun and the sky shine, and on a layout that was moved."""
    line = ["bake", "cornell-box", "--texels", "1500", "--rays", "16", *sky.split()]
    assert run([*line, "-o", str(tmp_path / "a"), "--parts", "--padding", "6"]) == 0
    whole, direct, indirect = parts_of(tmp_path / "a")
    # each is rounded by half of the last of 11 bits; below 6.1e-5 half floats have fewer
    np.testing.assert_allclose(direct + indirect, whole, rtol=2.0**-10, atol=1e-7)
    shares = direct.mean() / whole.mean(), indirect.mean() / whole.mean()
    assert min(shares) > 0.1, shares


def test_floor_below_a_lamp_has_direct_light_alone_and_the_lamp_what_the_floor_reflects(tmp_path: Path) -> None:
    scene = tmp_path / "lamp.toml"
    scene.write_text(
        """
material = [{ name = "floor", albedo = [0.5, 0.5, 0.5] }, { name = "lamp", albedo = [0, 0, 0], emission = [1, 2, 3] }]
quad = [
  { name = "floor", material = "floor", origin = [-1, 0, 1], edge_u = [2, 0, 0], edge_v = [0, 0, -2] },
  { name = "lamp", material = "lamp", origin = [-1, 1, -1], edge_u = [2, 0, 0], edge_v = [0, 0, 2] },
]
"""
    )
    assert run(["bake", str(scene), "-o", str(tmp_path / "a"), "--texels", "400", "--rays", "16", "--parts"]) == 0
    whole, direct, indirect = (light.sum(2) for light in parts_of(tmp_path / "a"))
    lit = whole > 0
    assert ((direct > 0) ^ (indirect > 0))[lit].all() and (direct > 0).any() and (indirect > 0).any()


def test_a_solver_that_does_not_know_them_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = ["bake", "cornell-box", "-o", str(tmp_path / "a"), "--parts", "--solver", "shooting"]
    assert run(line) == 2
    assert "--parts: Shooting does not know direct and indirect light apart, Gathering does" in capsys.readouterr().err
    assert not (tmp_path / "a").exists()
