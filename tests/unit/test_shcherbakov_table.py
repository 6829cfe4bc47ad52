"""The table of the local matrix: small rows that are really measured, the whole solution, and what rows say of the paper's
claims."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from scene_files import written
from scipy.sparse import csr_array

from app.atlas.options import AtlasOptions
from app.bench.papers import shcherbakov
from app.bench.papers.local_walk import Differences, steps_of, walk
from app.bench.papers.shcherbakov_verdicts import verdicts
from app.bench.papers.whole_solution import (
    all_factors,
    find_direct,
    in_order,
    reflected,
    shown_light,
    whole_solution,
    write_light,
)
from app.bench.speed.rank_one import rank_one_times
from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.render.camera_path import load_path
from app.scene.authored import load_authored
from app.scene.library import scene_path
from app.scene.model import Scene
from app.session.batch import opened
from app.solvers.local.options import LocalOptions
from app.solvers.local.solver import Local
from app.util import cache
from app.util.tables import Row

SIZE, STEPS, EVERY = 64, 4, 2
DENSITY = 0.5  # texels along a metre


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """The smallest village."""
    text = scene_path("village").read_text().replace("blocks = 140\n", "blocks = 80\n")
    return load_authored(written(tmp_path_factory.mktemp("village"), "village.toml", text))


@pytest.fixture(scope="module", autouse=True)
def charts_are_kept(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The village is opened by nearly every test, and unfolded by the first."""
    with pytest.MonkeyPatch.context() as patch, cache.elsewhere(tmp_path_factory.mktemp("cache")):
        patch.setattr("app.atlas.charts_cache.FEWEST", 0)
        yield


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is left out because it takes long, however busy the machine is; patches of two metres, and few shadow rays."""
    monkeypatch.setattr(shcherbakov, "LONGEST", 1e9)
    monkeypatch.setattr(shcherbakov, "DENSITY", DENSITY)
    monkeypatch.setattr(shcherbakov, "SHADOW_RAYS", 4)


def test_light_from_outside_as_its_mean_is_a_row_of_its_own(gpu: Gpu, small: Scene) -> None:
    row = shcherbakov.measure_row(gpu, 0.02, SIZE, "inverse", small, steps=STEPS, every=EVERY, outside="constant")
    assert row["bounces"] == "inverse, constant outside" and row["picture"] >= 0
    assert "update_ms" not in row


@pytest.mark.parametrize("bounces", ["inverse", "iterate"])
def test_a_row_is_measured(gpu: Gpu, small: Scene, bounces: str) -> None:
    """Small and short: that numbers come out and are of one order, not which."""
    row = shcherbakov.measure_row(gpu, 0.02, SIZE, bounces, scene=small, steps=STEPS, every=EVERY)
    assert row["walk"] == "4 steps, 2 compared" and row["patches"] > 10_000 and row["factors"] > row["patches"]
    assert row["matrix_mb"] == SIZE**2 * (8 if bounces == "inverse" else 2) / 2**20
    assert row["frame_ms"] == pytest.approx(row["lit_ms"] + row["swap_ms"])
    assert all(row[key] > 0 for key in ("swap_ms", "light_ms", "lit_ms", "step_ms"))
    assert 0 < row["total"] < row["indirect"] < 2, "64 patches do not light a village, but add little to direct light"
    assert row["indirect_inside"] is None, "a set this small has clusters alone"
    assert row["indirect"] < row["indirect_p99"] and 0 < row["picture"] < 0.3
    assert (row.get("update_ms", 0) > 0) == (bounces == "inverse")


def test_all_patches_are_lit_anew(gpu: Gpu, small: Scene) -> None:
    row = shcherbakov.measure_whole(gpu, 0.02, scene=small, rays=16)
    assert row["bounces"] == "all, by kept hits of 16 rays"
    assert row["patches"] > 10_000 and row["light_ms"] > 0 and row["matrix_mb"] > 0


def test_shown_as_the_whole_solution_nothing_differs(gpu: Gpu, small: Scene) -> None:
    """The light of the whole solution, written to the lightmap, is read in the same order; of the real one something differs,
    and where it takes too long nothing is compared."""
    options = LocalOptions(patches=SIZE, patch_level=0, shadow_rays=4)
    with opened(gpu, small, AtlasOptions(density=DENSITY), LightmapOptions(), options, "local") as (lightmap, made):
        assert isinstance(made, Local)
        find_direct(made)
        whole = whole_solution(made)
        assert whole.direct.mean() > 0 and whole.indirect.mean() > 0
        assert whole_solution(made) is whole, "solved once"
        write_light(lightmap, made.patches, whole.total)
        assert np.allclose(shown_light(made), whole.total, rtol=1e-5, atol=1e-9)
        position = lightmap.pool.image_from_tiles(lightmap.pool.surfaces.position)
        space, patches = lightmap.space, made.patches
        at = space.local_from_world(in_order(patches, position))
        assert np.allclose(at, patches.centre[: patches.count], atol=1e-4), "a texel of each patch, in order"
        F = all_factors(made, np.arange(made.patches.count))
        assert F.sum(1).max() <= 1 + 1e-9, "no light is made"
        flow = F * made.patches.area[: made.patches.count, None]
        assert abs(flow - flow.T).max() <= 1e-9 * flow.max(), "reciprocity"
        cameras = steps_of(load_path("village").cameras, 25)
        slow = walk(gpu, made, whole, cameras, 1e-6, every=1)
        assert slow.foreseen is not None and slow.picture is None and slow.text.startswith("left out: about")


def test_patches_of_several_texels_have_no_whole_solution(gpu: Gpu, small: Scene) -> None:
    options = LocalOptions(patches=SIZE, patch_level=1, shadow_rays=4)
    with opened(gpu, small, AtlasOptions(density=DENSITY), LightmapOptions(), options, "local") as (_, made):
        assert isinstance(made, Local)
        find_direct(made)
        with pytest.raises(UserError, match="one texel each"):
            whole_solution(made)


def test_light_between_two_patches_is_that_of_the_series() -> None:
    """H = Σ Fⁿ of two patches that see half of each other: by hand."""
    F = csr_array(np.array([[0.0, 0.5], [0.5, 0.0]]))
    H = reflected(F, np.full((2, 3), 0.5), np.array([[1.0] * 3, [0.0] * 3]))
    assert np.allclose(H, [[1 / 15] * 3, [4 / 15] * 3], rtol=1e-3)


def test_differences_are_over_the_mean_of_the_whole() -> None:
    found = Differences()
    assert found.mean is None and found.p99 is None
    found.add(np.array([[1.0, 1, 1], [2, 2, 5]]), np.array([[1.0, 1, 1], [2, 2, 2]]))
    assert found.mean == pytest.approx(0.5 / 1.5) and found.p99 == pytest.approx(0.99 / 1.5, rel=1e-4)


def test_an_update_is_timed(gpu: Gpu) -> None:
    found = rank_one_times(gpu, 256, 0.1)
    assert 0 < found.constant < found.update and found.copy > 0 and found.vector > 0


# -- verdicts ----------------------------------------------------------------------------------------------------------


def row(size: int, bounces: str, **more: Any) -> Row:
    known = {"size": size, "bounces": bounces, "swap_ms": 1.0, "light_ms": 1.0, "lit_ms": 1.0, "frame_ms": 2.0}
    return known | {"step_ms": 9.0, "picture": 0.01} | more


def rows(**better: Any) -> list[Row]:
    """As the paper found them; ``better``: numbers of one row by its name."""
    update = {"update_ms": 2.0, "copy_ms": 1.5, "constant_ms": 1.2, "vector_ms": 0.1}
    found = {
        "inverse": row(512, "inverse", **update),
        "series": row(512, "series"),
        "iterate": row(512, "iterate", lit_ms=3.0, frame_ms=4.0),
        "whole": {"bounces": "all", "patches": 1000, "light_ms": 50.0},
    }
    for name, numbers in better.items():
        found[name] |= numbers
    return list(found.values())


PLAIN = "The matrix of several reflections outperforms plain radiosity on the local set"


@pytest.mark.parametrize(
    ("claim", "better"),
    [
        (PLAIN + ":", {"iterate": {"lit_ms": 0.5}}),
        (PLAIN + ", with a swap", {"iterate": {"frame_ms": 0.5}}),
        ("Pictures differ by less than 0.05", {"series": {"picture": 0.05}}),
        ("Updates of rank one", {"inverse": {"copy_ms": 0.8}}),
    ],
)
def test_a_verdict_turns_with_the_numbers(claim: str, better: dict[str, Any]) -> None:
    (before,) = (line for line in verdicts(rows()) if line.startswith(claim))
    (after,) = (line for line in verdicts(rows(**better)) if line.startswith(claim))
    assert "holds here, because" in before
    assert "does not hold here, because" in after


def test_a_claim_may_hold_of_one_way_alone() -> None:
    """And of one that is hardly faster nothing is said."""
    (line,) = (line for line in verdicts(rows(series={"lit_ms": 5.0})) if line.startswith(PLAIN + ":"))
    assert "holds here, because 512 inverse 1.00 ms for 3.00. It does not hold here, because 512 series 5.00" in line
    (line,) = (line for line in verdicts(rows(series={"lit_ms": 2.9})) if line.startswith(PLAIN + ":"))
    assert ". It is undecided here, because 512 series 2.90 ms for 3.00" in line


@pytest.mark.parametrize(
    ("better", "says"),
    [
        ({}, "75% of the bandwidth of a copy, which bounds it"),
        ({"copy_ms": 0.8, "constant_ms": 0.9, "vector_ms": 0.4}, "what its fragments compute bounds it"),
        ({"copy_ms": 0.5}, "fragments bound it: a constant colour takes 60% of its time"),
        ({"copy_ms": 0.8}, "nothing that was measured bounds it"),
    ],
)
def test_what_bounds_an_update(better: dict[str, Any], says: str) -> None:
    (line,) = (line for line in verdicts(rows(inverse=better)) if line.startswith("Updates"))
    assert says in line


def test_from_so_many_patches_on_a_local_set_pays() -> None:
    """50 µs for each patch: 1 ms is 20 of them, 9 ms 180."""
    (line,) = (line for line in verdicts(rows()) if line.startswith("All 1,000 patches"))
    assert "50.00 µs for each" in line and "512 inverse: 20 and 180" in line


def test_what_no_row_can_judge_is_not_judged() -> None:
    assert verdicts([]) == []
    assert verdicts([row(512, "series", picture=None)]) == []


def test_the_plot_leaves_out_what_has_no_size() -> None:
    table_plot = pytest.importorskip("app.bench.papers.table_plot", reason="of the extra bench", exc_type=ImportError)
    plot = shcherbakov.TABLE.plot
    assert plot is not None
    labels = [label for label, *_ in table_plot.lines(plot, rows())]
    assert labels == [f"{bounces}: {y} ms" for bounces in ("inverse", "series", "iterate") for y in ("lit", "frame")]
