"""Curved surfaces: xatlas in a process of its own, its cache, and what happens when it fails."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from atlas_scenes import TURN, box_room, face_areas, moved, own_cache, scene_of, split_grid

import app.atlas.large_surfaces as large_surfaces
import app.atlas.unwrap as unwrap_module
from app.atlas.charts import Charts
from app.atlas.facets import facets
from app.atlas.parametrize import parametrize
from app.atlas.sides import scene_size, weld
from app.atlas.unwrap import Unfolded, unwrap
from app.scene import shapes
from app.scene.model import F64, I32, Material, Scene

__all__ = ["own_cache"]

BALL = shapes.icosphere(0.5, 3)
DRUM = shapes.cylinder(0.4, 1.2, 48)


def _unwrap(scene: Scene, **options: float) -> Unfolded:
    points, corners = weld(scene)
    flat = facets(points, corners, scene.material_ids, scene_size(scene))
    return unwrap(points, corners, scene.corners, scene.material_ids, flat, **options)


def _areas(uv: np.ndarray) -> np.ndarray:
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("mesh", [BALL, DRUM], ids=["ball", "drum"])
def test_charts_are_to_scale_and_right_handed(mesh: shapes.Mesh, scale: float) -> None:
    scene = moved(scene_of([mesh]), TURN @ np.diag([scale, scale, scale, 1.0]))
    unfolded = _unwrap(scene)
    area = scene.normals_areas[1]
    assert unfolded.by_xatlas == unfolded.chart.max() + 1 < len(scene.triangles) / 4
    assert (_areas(unfolded.uv) > 0).all()
    for c in range(unfolded.by_xatlas):
        mine = unfolded.chart == c
        # by construction; float64 sums
        assert np.isclose(_areas(unfolded.uv[mine]).sum(), area[mine].sum(), rtol=1e-9)
    # conformal maps of gently curved charts: a sphere cut into a few dozen charts stretches by well under half
    assert (np.abs(np.log2(_areas(unfolded.uv) / area)) < 0.7).all()


def test_a_stretched_page_is_undone() -> None:
    scene = moved(scene_of([split_grid(shapes.quad((0, 0, 0), (2, 0, 0), (0, 1, 0)), 4, 3)]), TURN)
    flat = np.linalg.inv(TURN[:3, :3]) @ (scene.corners - TURN[:3, 3])[..., None]
    page = flat[..., :2, 0] * (-300.0, 50.0) + (1000.0, 7.0)  # mirrored, too
    chart, uv = unwrap_module._to_scale(np.zeros(24, np.int32), page, scene.corners)
    assert (chart == 0).all()
    expected = flat[..., :2, 0]
    assert np.allclose(uv - uv[0, 0], expected - expected[0, 0], atol=1e-9)  # float64
    page[5] = page[5, 0]
    page[7] = page[7, ::-1]
    chart, _ = unwrap_module._to_scale(np.zeros(24, np.int32), page, scene.corners)
    assert np.flatnonzero(chart < 0).tolist() == [5, 7]  # without area, and turned over


def test_charts_never_mix_materials_nor_objects_apart() -> None:
    scene = scene_of([BALL, BALL.moved(3, 0, 0)], [Material("a"), Material("b")])
    unfolded = _unwrap(scene)
    for c in range(unfolded.chart.max() + 1):
        assert len(np.unique(scene.material_ids[unfolded.chart == c])) == 1


def test_a_second_run_reads_the_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of([shapes.icosphere(0.5123, 2)])
    first = _unwrap(scene)

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("started a worker")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    second = _unwrap(scene)
    assert (first.chart == second.chart).all() and (first.uv == second.uv).all()
    with pytest.raises(AssertionError, match="started a worker"):
        _unwrap(scene_of([shapes.icosphere(0.5123, 2).moved(0, 1, 0), DRUM]))


def test_a_damaged_cache_file_is_made_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(tmp_path))
    scene = scene_of([shapes.icosphere(0.5456, 2)])
    first = _unwrap(scene)
    (newest,) = (tmp_path / "unwrap").glob("*.npz")
    newest.write_bytes(newest.read_bytes()[:100])
    assert (_unwrap(scene).uv == first.uv).all()
    assert newest.stat().st_size > 100


def test_the_cache_keeps_the_newest_files(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(tmp_path))
    monkeypatch.setattr(unwrap_module, "CACHE_FILES", 2)
    for radius in (0.3, 0.4, 0.5):
        _unwrap(scene_of([shapes.cylinder(radius, 1.0, 12)]))
    assert len(list((tmp_path / "unwrap").iterdir())) == 2


def _assert_flat_pieces(scene: Scene, unfolded: Unfolded) -> None:
    assert unfolded.by_xatlas == 0
    # flat pieces lie in their plane: every edge keeps its length (float64)
    lengths = np.linalg.norm(scene.corners - np.roll(scene.corners, 1, axis=1), axis=2)
    assert np.allclose(np.linalg.norm(unfolded.uv - np.roll(unfolded.uv, 1, axis=1), axis=2), lengths, rtol=1e-6)
    assert (_areas(unfolded.uv) > 0).all()


def test_a_time_limit_falls_back_to_flat_pieces() -> None:
    scene = moved(scene_of([shapes.cylinder(0.61, 1.0, 24)]), TURN)
    unfolded = _unwrap(scene, time_limit=0.0)
    assert unfolded.warnings == ("xatlas took longer than 0 s: every flat piece is a chart of its own",)
    assert unfolded.chart.max() + 1 == 24 + 2  # the side's quads and two discs
    _assert_flat_pieces(scene, unfolded)


@pytest.mark.parametrize(
    ("worker", "reason"),
    [
        ("import sys; sys.exit('no luck')", r"failed \(no luck\)"),
        ("import os; os.abort()", r"failed \(exit code -6\)"),
        ("pass", "wrote no charts"),
    ],
)
def test_a_failing_worker_falls_back(worker: str, reason: str, monkeypatch: pytest.MonkeyPatch) -> None:
    start = subprocess.Popen
    monkeypatch.setattr(
        subprocess, "Popen", lambda command, **options: start([sys.executable, "-c", worker], **options)
    )
    scene = scene_of([shapes.cylinder(0.62, 1.0, 8)])
    unfolded = _unwrap(scene)
    assert len(unfolded.warnings) == 1
    assert re.search(reason, unfolded.warnings[0])
    _assert_flat_pieces(scene, unfolded)


def test_cancelling_ends_the_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[subprocess.Popen[bytes]] = []
    start = subprocess.Popen

    def sleeper(command: object, **options: object) -> subprocess.Popen[bytes]:
        started.append(start([sys.executable, "-c", "import time; time.sleep(60)"], **options))  # type: ignore[call-overload]
        return started[-1]

    monkeypatch.setattr(subprocess, "Popen", sleeper)

    def cancel(stage: str, share: float) -> None:
        if stage == "unfolding curved pieces":
            raise KeyboardInterrupt

    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        parametrize(scene_of([shapes.cylinder(0.63, 1.0, 8), box_room()]), progress=cancel)
    assert started[0].poll() is not None
    assert time.monotonic() - begin < 30  # the worker would have slept for 60 s


def test_slivers_that_welding_flattens_keep_their_area() -> None:
    ball = shapes.icosphere(1.0, 1)
    far = shapes.quad((1000, 0, 0), (1, 0, 0), (0, 1, 0))
    sliver = shapes.Mesh(
        np.array([[0, 0, 2], [1, 0, 2], [1, 5e-5, 2.0]]), np.array([[0, 1, 2]]), np.zeros((3, 2))
    )  # the weld is 1e-4 wide in a scene of 1 km
    scene = scene_of([ball, far, sliver])
    charts: Charts = parametrize(scene)
    a, b = charts.face_uv[:, 1] - charts.face_uv[:, 0], charts.face_uv[:, 2] - charts.face_uv[:, 0]
    assert np.isfinite(charts.face_uv).all()
    assert (np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) > 0).all()
    assert len(face_areas(scene, charts)) == len(charts.face_uv)


def _counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many triangles each run of xatlas unfolds."""
    counts: list[int] = []
    unfold = unwrap_module._xatlas

    def counting(points: F64, triangles: I32, *rest: Any) -> tuple[I32, F64]:
        counts.append(len(triangles))
        return unfold(points, triangles, *rest)

    monkeypatch.setattr(unwrap_module, "_xatlas", counting)
    return counts


def test_copies_are_unfolded_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever they are, however turned and large; not what is mirrored, squeezed, or only listed alike."""
    counts = _counted(monkeypatch)
    pot = shapes.lathe([(0.3, 0.0), (0.5, 0.4), (0.2, 0.9), (0.35, 1.2)], 24)
    bent = shapes.Mesh(pot.positions + [0.02, 0, 0] * pot.positions[:, 1:2] ** 2, pot.triangles, pot.uv)
    mirrored = shapes.Mesh(pot.positions * (-1, 1, 1), pot.triangles[:, ::-1], pot.uv)
    copy = pot.transformed(shapes.transform((2, 1, 0), (31.0, 47.0, 13.0), 0.7))
    meshes = [pot, copy, mirrored.moved(4, 0, 0), bent.moved(6, 0, 0), copy.moved(0, 0, 3)]
    scene = scene_of(meshes, [Material("a"), Material("b")])
    unfolded = _unwrap(scene)
    assert counts == [3 * len(pot.triangles)]
    parts = [unfolded.uv[scene.object_ids == k] for k in range(5)]
    charts = [np.unique(unfolded.chart[scene.object_ids == k]) for k in range(5)]
    assert len(np.concatenate(charts)) == len(np.unique(np.concatenate(charts)))
    for k in (1, 4):  # each chart is that of the first one, smaller
        mine, first = unfolded.chart[scene.object_ids == k], unfolded.chart[scene.object_ids == 0]
        for a, b in zip(np.unique(mine), np.unique(first), strict=True):
            small, large = parts[k][mine == a], parts[0][first == b]
            assert np.allclose(small - small[0, 0], 0.7 * (large - large[0, 0]), atol=1e-6)  # float32 of the transform
    assert np.allclose(_areas(unfolded.uv).sum(), scene.normals_areas[1].sum())


def test_charts_of_large_surfaces_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sheet with waves: xatlas would make a few charts of it, in a time that grows with the square of their triangles."""
    monkeypatch.setattr(unwrap_module, "CHART", 64)
    monkeypatch.setattr(large_surfaces, "LARGE", 256)
    monkeypatch.setattr(large_surfaces, "PIECE", 512)
    monkeypatch.setattr(large_surfaces, "STEEP", 2.0)  # nothing is seen whole
    flat = split_grid(shapes.quad((0, 0, 0), (2, 0, 0), (0, 0, -2)), 32, 32)
    waves = 0.1 * np.sin(5 * flat.positions[:, :1]) * np.cos(4 * flat.positions[:, 2:])
    scene = scene_of([shapes.Mesh(flat.positions + [0, 1, 0] * waves, flat.triangles, flat.uv), BALL.moved(0, 3, 0)])
    unfolded = _unwrap(scene)
    sheet = scene.object_ids == 0
    assert np.bincount(unfolded.chart[sheet]).max() < 2 * 64
    area = scene.normals_areas[1]
    assert (np.abs(np.log2(_areas(unfolded.uv)[sheet] / area[sheet])) < 0.5).all()  # gently curved
    assert unfolded.by_xatlas == unfolded.chart.max() + 1
