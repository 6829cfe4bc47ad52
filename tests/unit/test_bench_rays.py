"""``glowtree bench rays``: which rays are traced, and what is printed of them."""

from __future__ import annotations

import importlib.util
import json

import numpy as np
import pytest

from app.atlas.parametrize import parametrize
from app.bench.speed import rays
from app.bench.speed.ray_batch import RayBatch
from app.bench.speed.rays import SQUARE, million_a_second, texel_rays
from app.cli import run
from app.gpu import Gpu
from app.lightmap.tile_pool import TilePool
from app.scene.load import load_scene
from app.visibility.rays import RayScene


@pytest.fixture(scope="module")
def pool() -> TilePool:
    scene = load_scene("furnace")
    return TilePool(scene, parametrize(scene, texels=2000))


@pytest.mark.parametrize("shared", [True, False])
@pytest.mark.parametrize("count", [SQUARE, 1 << 14])
def test_rays_leave_texels_about_their_cosine(gpu: Gpu, pool: TilePool, count: int, shared: bool) -> None:
    origins, directions = texel_rays(pool, count, shared)
    assert origins.shape == directions.shape == (count, 4)
    np.testing.assert_allclose(np.linalg.norm(directions[:, :3], axis=1), 1, atol=1e-6)
    traced = RayScene(gpu, pool)
    batch = RayBatch(gpu, traced, origins, directions)
    hits = batch.closest()
    assert (hits.triangle >= 0).all(), "the furnace is closed"
    assert hits.front.all(), "they leave into the room"
    batch.release()
    traced.release()
    one = directions[:SQUARE, :3]
    assert (np.ptp(one, axis=0).max() < 1e-6) == shared, "a square of one wall has one direction"


def test_the_rate_is_that_of_the_median_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(np.cumsum([0.0, 1.0, 0.0, 2.0, 0.0, 9.0]))
    monkeypatch.setattr(rays.time, "perf_counter", lambda: next(clock))
    assert million_a_second(lambda: None, 4_000_000, 0.1) == 2.0


def test_scenes_are_measured(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(rays, "RAYS", 1 << 10)
    monkeypatch.setattr(rays, "TEXELS", 1000)
    command = ["bench", "rays", "cornell-box", "furnace", "--seconds", "0.01"]
    assert run([*command, "--json"]) == 0
    values = json.loads(capfd.readouterr().out)
    assert [row["scene"] for row in values["scenes"]] == ["cornell-box", "furnace"]
    embree = importlib.util.find_spec("embreex") is not None
    for row in values["scenes"]:
        assert row["triangles"] > 10 and row["megabytes"] > 0 and row["cost"] > 1 and row["depth"] > 1
        for query in ("closest", "any"):
            assert all(row[f"{query}_{kind}"] > 0 for kind in ("coherent", "incoherent"))
            assert (f"embree_{query}" in row) == embree
    assert run(command) == 0
    text = capfd.readouterr().out
    assert "| cornell-box |" in text and ("Embree" in text) == embree
