"""Rows of form factors: what rays hit, at every level at once, in memory and on disk."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from solver_scenes import table_room

from app.atlas.parametrize import parametrize
from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.lightmap.tile_pool import TilePool
from app.solvers.local.form_factors import LocalSet
from app.solvers.local.patches import Patches, patches_of
from app.solvers.local.rows import LOST, Rows
from app.util.parts import run_to_end
from app.visibility.origins import Origins
from app.visibility.rays import RayScene

RAYS = 64


class World:
    """A lightmap with its patches, and rows of them."""

    def __init__(self, gpu: Gpu) -> None:
        scene = table_room()
        self.gpu, self.lightmap = gpu, Lightmap(gpu, TilePool(scene, parametrize(scene, density=4)))
        self.scene, self.origins = RayScene(gpu, self.lightmap.pool), Origins(gpu, self.lightmap)
        self.patches: Patches = patches_of(self.lightmap.pool, 0, lambda texels: np.zeros(len(texels)))

    def rows(self, mebibytes: int = 64, rays: int = RAYS, least: int = 16) -> Rows:
        return Rows(self.gpu, self.lightmap, self.scene, self.origins, self.patches, rays, mebibytes, least)

    def release(self) -> None:
        for part in (self.origins, self.scene, self.lightmap):
            part.release()


@pytest.fixture
def world(gpu: Gpu, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[World]:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    world = World(gpu)
    yield world
    world.release()


def test_a_row_names_texels(world: World) -> None:
    rows, nodes = world.rows(), np.arange(20)
    assert not rows.has(nodes).any()
    run_to_end(rows.make(nodes, nodes))
    hits = rows.of(nodes)
    assert rows.has(nodes).all() and hits.shape == (20, RAYS)
    assert (rows.starts(nodes) == nodes[:, None]).all(), "each is a texel"
    assert ((hits < len(world.patches.order)) | (hits == LOST)).all()
    assert (hits == LOST).mean() == 0, "the room is closed"
    rows.release()


def test_rays_of_a_cluster_start_all_over_it(world: World) -> None:
    """Its row is the mean of those of its patches, but for noise: 2 σ of its rays to an object of a quarter of what is seen."""
    rows, patches = world.rows(rays=1024), world.patches
    cluster = int(np.flatnonzero((patches.level == 2) & (patches.end - patches.start > 8))[0])
    members = np.flatnonzero(
        (patches.level == 0) & (patches.start >= patches.start[cluster]) & (patches.end <= patches.end[cluster])
    )
    nodes = np.concatenate([[cluster], members])
    run_to_end(rows.make(nodes, nodes))
    hits = rows.of(nodes)
    to = world.lightmap.scene.object_ids[world.lightmap.charts.face_triangle[patches.face[hits]]]
    shares = np.array([np.bincount(row, minlength=8) / 1024 for row in to])
    mean = np.average(shares[1:], axis=0, weights=patches.area[members])
    np.testing.assert_allclose(shares[0], mean, atol=0.03)
    assert mean.max() > 0.1
    rows.release()


def test_rows_are_read_from_disk_the_next_time(world: World) -> None:
    rows, nodes = world.rows(), np.arange(10, 40)
    run_to_end(rows.make(nodes, nodes))
    hits = rows.of(nodes).copy()
    rows.release()
    again = world.rows()
    assert again.from_disk == 30 and again.traced == 0
    np.testing.assert_array_equal(again.of(nodes), hits)
    again.release()
    other = world.rows(rays=32)
    assert other.from_disk == 0, "other rays are other rows"
    other.release()


@pytest.mark.parametrize("what", [b"no file", b""])
def test_a_file_that_is_broken_is_none(world: World, what: bytes) -> None:
    rows = world.rows()
    run_to_end(rows.make(np.arange(5), np.arange(5)))
    rows.save()
    rows.file.write_bytes(what)
    again = world.rows()
    assert again.from_disk == 0
    again.release()
    rows.release()


def test_memory_ends_with_rows_that_nobody_needs(world: World) -> None:
    """Of 1 MiB with 1024 rays, 256 rows."""
    rows, needed = world.rows(mebibytes=1, rays=1024, least=100), np.arange(50)
    for first in range(0, 300, 50):
        some = np.arange(first, first + 50)
        run_to_end(rows.make(some, np.concatenate([needed, some])))
        assert rows.memory <= 2**20 and rows.has(needed).all() and rows.has(some).all()
    assert not rows.has(np.arange(50, 250)).all()
    rows.release()
    with pytest.raises(UserError, match="--row-memory 1: 600 rows of 1024 rays take 3 MiB"):
        world.rows(mebibytes=1, rays=1024, least=300)


def test_what_enters_and_leaves_leaves_sums_as_they_are(world: World) -> None:
    """Σ_j F_ij that is kept up to date is that of the rows, and pairs are reciprocal at any time."""
    rows, nodes = world.rows(), np.arange(64)
    run_to_end(rows.make(nodes, nodes))
    held, random = LocalSet(world.patches, rows, 64), np.random.default_rng(1)
    for node in nodes[:40]:
        held.enter(int(node), held.first_free())
    for _ in range(100):
        held.leave(int(random.choice(held.nodes)))
        held.enter(int(random.choice(np.setdiff1d(nodes, held.nodes))), held.first_free())
    there = held.node >= 0
    F, area = held.matrix().toarray(), held.area[there][:, None]
    np.testing.assert_allclose(F.sum(1), held.row_sum[there], atol=1e-9)
    np.testing.assert_allclose(area * F, (area * F).T, atol=1e-9)
    slots = np.flatnonzero(there)
    np.testing.assert_allclose(held.kernel(int(slots[3]))[there] * held.area[there], F[3], atol=1e-9)
    assert not held.row_sum[~there].any() and not held.outside[~there].any()
    rows.release()
