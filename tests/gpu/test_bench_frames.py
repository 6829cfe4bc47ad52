"""``glowtree bench frames``: what a hand does to the sliders, and what is printed of it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from app.bench.speed import frames, slider_drag
from app.bench.speed.slider_drag import DECADES, DEPTHS, DRAGGED, SWEEP, SWEEPS, drag
from app.cli import run
from app.lightmap.options import LightmapOptions


def test_a_hand_goes_there_and_back_in_small_steps() -> None:
    start = LightmapOptions(depth=6)
    gradients = np.log10([o.gradient for o in drag("gradient", start)])
    assert len(gradients) == SWEEP * SWEEPS
    assert np.isclose(gradients[-1], np.log10(start.gradient)), "back where it was"
    assert np.isclose(np.ptp(gradients), DECADES)
    np.testing.assert_allclose(np.abs(np.diff(gradients)), DECADES / SWEEP)
    depths = np.array([o.depth for o in drag("depth", start)])
    assert (depths.max(), depths.min(), depths[-1]) == (*DEPTHS, DEPTHS[0])
    assert np.abs(np.diff(depths)).max() == 1
    assert min(o.gradient for o in drag("gradient", start.replace(gradient=2e-4))) == 1e-4, "the slider's end"


def test_drags_are_measured(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(slider_drag, "SWEEP", 4)
    monkeypatch.setattr(frames, "WARM_UP", 2)
    command = ["bench", "frames", "cornell-box", "--adaptive", "--drag", "--texels", "2000", "--depth", "3"]
    assert run([*command, "--json"]) == 0
    values = json.loads(capfd.readouterr().out)
    assert values["leaves_after_1_s"] > values["leaves_opened"] > 0
    assert set(values["drags"]) == set(DRAGGED)
    for row in values["drags"].values():
        assert row["frames"] == 4 * SWEEPS and row["leaves"] > 0
        assert 0 < row["median_ms"] <= row["p99_ms"] <= row["worst_ms"]
        assert 0 <= row["slow_frames"] <= row["frames"]
    text = frames._drag_table(values)
    assert "dragging gradient, 16 frames" in text and "dragging depth, 16 frames" in text


WALK = """
seconds = 0.3
[[key]]
position = [0.2, 0.2, 0.2]
target = [0.3, 0.3, -0.5]
[[key]]
position = [0.35, 0.2, 0.1]
target = [0.3, 0.3, -0.5]
"""


def test_a_walk_is_measured(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "walk.toml"
    path.write_text(WALK)
    command = ["bench", "frames", "cornell-box", "--texels", "1500", "--solver", "local", "--patches", "128"]
    assert run([*command, "--walk", str(path), "--json"]) == 0
    values = json.loads(capfd.readouterr().out)
    assert values["frames"] == 9, "a thirtieth of a second each, whatever the path says"
    assert 0 < values["median_ms"] <= values["p99_ms"] <= values["worst_ms"]
    assert 0 <= values["nodes_to_come"] <= 128
    assert values["open_s"] > 0 and values["set_whole_s"] > 0
    assert values["switch_ms"] > 0 and values["first_switch_ms"] > 0
    assert "a walk of 9 frames" in frames._walk_table(values)
