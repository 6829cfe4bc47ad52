"""What bounds a shot: bytes that must move, and the receiver pass without its arithmetic."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from app.atlas.options import AtlasOptions
from app.bench.speed.memory_copy import MemoryCopy
from app.bench.speed.receiver_traffic import ReceiverTraffic, texel_bytes
from app.bench.speed.shots import bounds
from app.bench.timing import BATCH, passes_ms
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.session.batch import opened
from app.solvers import ShootingOptions
from app.solvers.shooting.solver import Shooting
from app.util.parts import run_to_end

GB = 1e9


@pytest.mark.parametrize(
    ("receive_ms", "stream_ms", "copy_ms", "bound"),
    [
        (10.0, 10.0, 5.0, "memory"),
        (10.0, 5.0, 4.9, "arithmetic"),
        (10.0, 9.0, 1.0, "fragments"),
        (10.0, 9.0, 4.9, "several"),
    ],
)
def test_what_bounds_the_receiver_pass(receive_ms: float, stream_ms: float, copy_ms: float, bound: str) -> None:
    moved = {"choose": 3e6, "receive": copy_ms * 1e-3 * GB}  # a copy of a GB each second
    row = bounds({"choose": 5.0, "receive": receive_ms}, moved, stream_ms, GB)
    assert row["bound"] == bound and row["copy_ms"] == pytest.approx(copy_ms)
    assert row["receive_share"] == pytest.approx(copy_ms / receive_ms)
    assert row["shot_mb"] == pytest.approx(3 + copy_ms)
    assert row["shot_share"] == pytest.approx((3 + copy_ms) / (5.0 + receive_ms)), "of a second at a GB each"


@pytest.mark.parametrize(("storage", "light"), [("rgba32f", 2 * 2 * 16), ("rgba16f", 2 * 2 * 8), ("fixed8", 2 * 2 * 4)])
def test_bytes_of_a_texel_follow_from_its_formats(gpu: Gpu, storage: str, light: int) -> None:
    held = LightmapOptions(storage=storage)
    with opened(gpu, "textured-room", AtlasOptions(texels=600), held, ShootingOptions()) as (lightmap, _):
        albedo = 4 * np.dtype(lightmap.pool.arrays["t_albedo"].dtype).itemsize
        assert texel_bytes(lightmap, planar=True) == light + albedo
        assert texel_bytes(lightmap, planar=False) == light + albedo + 16 + 8


@pytest.mark.parametrize("visibility", ["item-id", "combined"])
def test_the_traffic_draws_the_texels_of_the_receiver_pass_and_changes_no_light(gpu: Gpu, visibility: str) -> None:
    options = ShootingOptions(visibility=visibility)
    with opened(gpu, "cornell-box", AtlasOptions(texels=8_000), LightmapOptions(), options) as (lightmap, solver):
        assert isinstance(solver, Shooting) and set(solver.batch.receivers.meshes) == {True, False}
        solver.reset()
        run_to_end(solver.work(BATCH))
        traffic, steps = ReceiverTraffic(gpu, solver), solver.passes(BATCH)
        steps["choose"]()
        before = lightmap.irradiance(), lightmap.residual()
        traffic.run()
        for was, now in zip(before, (lightmap.irradiance(), lightmap.residual()), strict=True):
            # what is read is below 2^32, and 1e-30 of it is added
            np.testing.assert_allclose(was, now, rtol=0, atol=1e-20 * lightmap.unit * BATCH)
        query = gpu.ctx.query(samples=True)
        with query:
            steps["receive"]()
        moved = traffic.moved()
        maps = moved["see"] / 2 * (1 if visibility == "item-id" else 2)
        received = (moved["receive"] - maps) * BATCH
        least, most = (query.samples * texel_bytes(lightmap, planar=planar) for planar in (True, False))
        assert 0 < least < received < most


def test_all_of_it_is_timed_in_turns(gpu: Gpu) -> None:
    with opened(gpu, "furnace", AtlasOptions(texels=600), LightmapOptions(), ShootingOptions()) as (lightmap, solver):
        copy, runs = MemoryCopy(gpu, lightmap.size), list[Any]()

        def run() -> None:
            runs.append(None)
            copy.run()

        times = passes_ms(gpu, solver, 0.0, {"copy": run})
        assert copy.moved == 2 * 16 * lightmap.size[0] * lightmap.size[1]
        copy.release()
    assert list(times) == [*solver.passes(BATCH), "copy"] and len(runs) == 5
    assert all(ms > 0 for ms in times.values())
