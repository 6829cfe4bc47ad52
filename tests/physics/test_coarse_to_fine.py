"""What a patch shoots: its mean, what will come back, and not too much at once; from large patches to fine ones."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from solver_scenes import Solution, begin, grey, quads_scene, room

from app.gpu import Gpu
from app.scene.load import load_scene
from app.scene.model import Scene
from app.solvers.shooting.emitter_groups import MOST
from app.solvers.shooting.records import EMITTER, Shot

EXACT = 1e-5  # sums of 32-bit floats


def lamp_room(albedo: float) -> Scene:
    """A closed room under a ceiling that emits."""
    return quads_scene(room((2.0, 1.0, 1.0)), [grey(albedo), grey(albedo, 3.0)], [0, 1, 0, 0, 0, 0])


def patch_of(solution: Solution, shot: Shot) -> tuple[int, slice, slice]:
    """Its texels in an array (tiles, t, t)."""
    (column, x), (row, y) = (divmod(c, solution.lightmap.pool.tile) for c in shot.corner)
    return row * solution.lightmap.columns + column, slice(y, y + shot.size), slice(x, x + shot.size)


def flux_of(solution: Solution) -> np.ndarray:
    """(tiles, t, t) Σ_rgb r A of every texel [W]."""
    return (solution.lightmap.residual().sum(-1) * solution.lightmap.pool.surfaces.area).astype(np.float64)


@pytest.mark.usefixtures("undivided")
def test_a_patch_shoots_its_mean_and_keeps_what_is_uneven(gpu: Gpu) -> None:
    """Black walls: nothing comes back. The residual is a ramp along the lamp."""
    box = begin(gpu, lamp_room(0.0), texels=2000, coarsen=False)
    texture = box.lightmap.texture("t_residual")
    r = np.frombuffer(texture.read(), np.float32).reshape(*box.lightmap.size[::-1], 4).copy()
    r[..., :3] *= np.linspace(1, 2, r.shape[1], dtype=np.float32)[None, :, None]
    texture.write(r.tobytes())
    before = flux_of(box)
    box.step(1)
    box.solver.poll(wait=True)
    shot = box.solver.last_shot
    after = flux_of(box)
    patch = patch_of(box, shot)
    area = box.lightmap.pool.surfaces.area[patch]
    assert shot.size > 1 and np.ptp(before[patch] / area) > 0.01 * before[patch].mean() / area.mean()
    assert abs(after[patch].sum()) < EXACT * before[patch].sum()
    np.testing.assert_allclose(after[patch], before[patch] - before[patch].sum() * area / area.sum(), atol=1e-6)
    after[patch] = before[patch]
    np.testing.assert_allclose(after, before, atol=1e-6)
    box.release()


def test_light_that_will_come_back_is_shot_ahead(gpu: Gpu) -> None:
    """And owed: residuals go below zero, the book stays closed, and the same solution takes fewer shots."""
    with_it, without = (begin(gpu, lamp_room(0.7), texels=2000, residual=1e-3) for _ in range(2))
    lowest = 0.0
    for box in (with_it, without):
        while not box.solver.poll().converged:
            box.step(8)
            box.solver.poll()
            if box is without:
                box.solver.batch.ambient.even_target.clear()
            elif box.solver.issued % 64 == 0:
                lowest = min(lowest, flux_of(box).min())
        box.solver.poll(wait=True)
    assert lowest < 0
    assert with_it.solver.issued < 0.8 * without.solver.issued
    assert abs(with_it.book.imbalance_share) < 5e-3  # form factors
    # each is off by what it left unshot, ten times its residual of what cancels within a tile
    assert np.sqrt(((with_it.H - without.H) ** 2).mean()) < 0.01 * with_it.H.mean()
    for box in (with_it, without):
        box.release()


def test_a_lamp_is_divided_and_fills_a_batch(gpu: Gpu) -> None:
    """Until a patch holds 2 % of the light, and several of one tile shoot at once."""
    box = begin(gpu, lamp_room(0.3), texels=2000, level=3, coarsen=False)
    emission = box.lightmap.emission().sum(-1) * box.lightmap.pool.surfaces.area
    box.step(8)
    assert box.solver.poll(wait=True).done == 8 > np.count_nonzero(emission.sum((1, 2)))
    for _ in range(20):
        box.step(1)
        box.solver.poll(wait=True)
        shot = box.solver.last_shot
        sent = emission[patch_of(box, shot)].sum()
        assert sent == 0 or (1 < shot.size < 8 and sent <= MOST * emission.sum())
    box.release()


def test_what_is_partly_covered_shoots_from_its_finest_patches(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """Large patches elsewhere: the blocks, which hang a little above the floor, stand on none of it."""
    monkeypatch.setattr("app.solvers.shooting.coarse_to_fine.FIRST_PATCHES", 50)
    scene = load_scene("cornell-box")
    block = ["block" in scene.objects[k] for k in scene.object_ids]
    raised = scene.positions.copy()
    raised[np.unique(scene.triangles[block]), 1] += 0.002 * np.ptp(scene.positions[:, 1])
    box = begin(gpu, dataclasses.replace(scene, positions=raised), texels=8000, level=1)
    largest, straddles = 0, 0
    for _ in range(300):
        lit = box.lightmap.irradiance().sum(-1)
        box.step(1)
        box.solver.poll(wait=True)
        shot = box.solver.last_shot
        largest = max(largest, shot.size)
        patch = patch_of(box, shot)
        H = lit[patch][box.lightmap.pool.surfaces.area[patch] > 0]
        if H.min() < 0.04 * H.max():
            straddles += 1
            assert shot.size <= 2
    assert largest > 2 and straddles > 0
    box.release()


def test_a_patch_shoots_for_its_family_and_is_paid_back_evenly(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """The room is lit long before all of the lamp has shot. When the others of each family shoot, and what was shot for them is
    taken back, in the same batch, the light stays as it is; in the end it is that of patches which shot for themselves only."""
    monkeypatch.setattr("app.solvers.shooting.coarse_to_fine.FIRST_PATCHES", 100)
    scene, options = load_scene("cornell-box"), {"texels": 8000, "residual": 2e-3, "resolution": 128}
    alone = begin(gpu, scene, coarsen=False, **options)
    alone.settle()
    box = begin(gpu, scene, **options)
    patches = np.count_nonzero(box.solver.batch.marks.levels)
    received, owed, said = [], 0.0, [set[str](), set[str](), []]
    while not (progress := box.solver.poll()).converged:
        words = said[box.solver.batch.phases.index]
        words.append(progress.doing) if isinstance(words, list) else words.add(progress.doing)
        box.step(8)
        box.solver.poll(wait=True)
        received.append((box.solver.batch.phases.index, np.average(box.H.mean(1), weights=box.area)))
        if (
            box.solver.batch.phases.index == 0
            and not owed
            and received[-1][1] > 0.5 * np.average(alone.H.mean(1), weights=alone.area)
        ):
            owed = -flux_of(box).min() / box.lightmap.emitted.sum()
            assert patches
    paid = [light for phase, light in received if phase == 1]
    fine = [light for phase, light in received if phase == 2]
    assert said[0] == {""} and any("settle" in text for text in said[1])
    uneven = [float(text.split()[-2]) for text in said[2] if "even out" in text]
    assert uneven[-1] < 0.5 * uneven[0], "what is left for finer patches is said, and goes down"
    assert owed > 2 * MOST  # one patch holds no more
    assert len(paid) > 3
    for light in (*paid, *fine):
        assert light == pytest.approx(
            fine[-1], rel=0.01
        )  # ten times its residual may be unshot when the first are paid
    assert np.sqrt(((box.H - alone.H) ** 2).mean()) < 0.02 * alone.H.mean()
    for one in (box, alone):
        one.release()


@pytest.mark.parametrize("texels, shares", [(300, False), (20_000, True)])
def test_where_texels_hold_much_of_the_light_none_shoots_for_others(gpu: Gpu, texels: int, shares: bool) -> None:
    """It would be most of the lamp."""
    box = begin(gpu, load_scene("cornell-box"), texels=texels, level=2)
    marks = box.solver.batch.marks.levels
    power = box.lightmap.emission().sum(-1) * box.lightmap.pool.surfaces.area
    assert (power.max() <= MOST * power.sum()) == shares
    assert marks.any() and (marks.max() >= EMITTER) == shares
    box.release()
