"""Radiosity on texture quadtrees: even light splits nothing; shadows do; and it does not matter when."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from solver_scenes import Solution, begin, grey, quads_scene, room, table_room

from app.gpu import Gpu
from app.lightmap.collapse import collapse
from app.lightmap.refinement import MERGE
from app.scene.load import load_scene
from app.scene.model import Scene

DENSITY = 4.0  # of the roots [1/m]
ROUGH = 0.1  # a threshold that splits about half of a room with shadows
FEW_STEPS = 1500
FORM_FACTORS = 0.005  # what they are off by, see test_energy.py
PATCHES = 0.01  # of the light of patches that are as large as their distance


def grown(gpu: Gpu, scene: Scene, **options: object) -> Solution:
    """Not shot yet."""
    known: dict[str, object] = {
        "density": DENSITY,
        "level": 2,
        "resolution": 64,
        "depth": 2,
        "gradient": ROUGH,
        "residual": 0.02,
    }
    return begin(gpu, scene, adaptive=True, **(known | options))  # type: ignore[arg-type]


@pytest.fixture
def planted(gpu: Gpu) -> Iterator[Callable[..., Solution]]:
    made: list[Solution] = []

    def plant(scene: Scene, **options: object) -> Solution:
        made.append(grown(gpu, scene, **options))
        return made[-1]

    yield plant
    for one in made:
        one.release()


def test_furnace(planted: Callable[..., Solution]) -> None:
    """All walls alike: B = E/(1 - ρ) everywhere, so once it is there, nothing is to be refined. (On the way there is: light that
    has been shot by some walls only is uneven.)"""
    scene = load_scene("furnace")
    box = planted(scene, density=16.0, residual=2e-3, gradient=0.8, depth=0)
    leaves = set(box.lightmap.refinement.tree.slots)  # type: ignore[attr-defined]
    box.settle(FEW_STEPS)
    box.refine(depth=2)
    for _ in range(12):  # until the leaves have been judged
        box.step(8)
        box.solver.poll()
    box.settle(FEW_STEPS)
    material = scene.materials[0]
    glow = np.pi * np.array(material.emission) / (1 - np.array(material.albedo))
    mean = (box.B * box.area[:, None]).sum(0) / box.area.sum()
    np.testing.assert_allclose(mean, glow, rtol=FORM_FACTORS + box.solver.options.residual)  # which is not shot
    assert set(box.lightmap.refinement.tree.slots) == leaves  # type: ignore[attr-defined]


def test_no_shadow_no_split(planted: Callable[..., Solution]) -> None:
    """A closed empty box has none."""
    walls = quads_scene(room(), [grey(0.5), grey(0.5, 3.0)], [0, 1, 0, 0, 0, 0])
    box = planted(walls, density=16.0, criterion="shadow", depth=3, residual=0.1)
    leaves = set(box.lightmap.refinement.tree.slots)  # type: ignore[attr-defined]
    box.settle(FEW_STEPS)
    assert set(box.lightmap.refinement.tree.slots) == leaves  # type: ignore[attr-defined]


# -- the table's shadow ------------------------------------------------------------------------------------------------

SHADOW: dict[str, object] = {"density": 5.0, "level": 1, "resolution": 128, "residual": 0.01, "gradient": 0.15}
# Energy that patches of a quarter of a metre make or lose where the table's feet stand on them: 0.3 to 0.6 %
CONTACTS = 0.01


def finest_light(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """H on the finest level of the atlas, whatever the leaves, and where there is a surface."""
    return collapse(solution.lightmap.pool, solution.lightmap.irradiance())


def levels(solution: Solution) -> np.ndarray:
    """Of the leaves, on the finest level of the atlas; beside a finer leaf between both."""
    pool = solution.lightmap.pool
    level = np.broadcast_to(pool.leaves.level[:, None, None, None], (*pool.surfaces.area.shape, 1))
    return collapse(pool, level.astype(np.float32))[0][..., 0]


def test_it_does_not_matter_when_the_tree_grows(planted: Callable[..., Solution]) -> None:
    """From the start, or after 800 shots onto the roots. Where both trees have leaves of one level, light differs by what the
    patches of other leaves make of it: by a hundredth, most of it on the lamp's back, a fifth of which sees one patch of the
    ceiling; where only one was split, which bends by less than the threshold, by what linear interpolation misses, 1/8 of a
    second difference."""
    early = planted(table_room(), **(SHADOW | {"depth": 2}))
    early.settle()
    late = planted(table_room(), **(SHADOW | {"depth": 0}))
    while late.solver.issued < 800:
        late.step(8)
    roots = late.lightmap.texel_count
    late.refine(depth=2)
    late.settle()
    assert min(early.lightmap.texel_count, late.lightmap.texel_count) > 2 * roots, "nothing grew"
    (a, here), (b, there) = finest_light(early), finest_light(late)
    both = here & there
    alike = levels(early) == levels(late)
    for where, most in ((both & alike, PATCHES), (both & ~alike, early.lightmap.options.gradient / 8)):
        assert where.sum() > both.sum() / 4
        assert np.sqrt(((a - b)[where] ** 2).mean() / (a[both] ** 2).mean()) < most
    assert max(abs(early.book.imbalance_share), abs(late.book.imbalance_share)) < CONTACTS


def test_a_tree_grows_as_deep_late_as_early(planted: Callable[..., Solution]) -> None:
    """New leaves hold interpolated light, in which there is nothing to split for, until earlier shots have been made again."""
    options = SHADOW | {"residual": 0.05, "resolution": 64, "depth": 2}
    early = planted(table_room(), **options)
    early.settle()
    late = planted(table_room(), **(options | {"depth": 0}))
    late.settle()
    late.refine(depth=2)
    late.settle()
    leaves = [set(one.lightmap.refinement.tree.slots) for one in (early, late)]  # type: ignore[attr-defined]
    # the first shots split what later light makes smooth beside its mean, and merging waits for an eighth of the threshold
    assert len(leaves[0]) > len(leaves[1]) > len(leaves[0]) / 2
    assert {level for level, _, _ in leaves[1]} == {level for level, _, _ in leaves[0]}
    late.refine(depth=2)
    late.settle()
    assert set(late.lightmap.refinement.tree.slots) == leaves[1], "it was not done"  # type: ignore[attr-defined]


def test_a_restart_after_a_slider_was_moved_is_a_restart(planted: Callable[..., Solution]) -> None:
    """An edit, other options and a restart while shots are made again leave nothing of that behind."""
    box = planted(table_room(), **(SHADOW | {"depth": 0, "residual": 0.1, "resolution": 64, "gradient": 0.06}))
    box.settle()
    for disturb in (
        lambda: box.solver.set_options(box.solver.options.replace(resolution=128)),
        lambda: box.solver.set_materials(box.lightmap.scene.materials),
        box.solver.reset,
    ):
        box.refine(depth=box.lightmap.options.depth + 1)
        while box.solver.batch.replay.under_way is None:  # type: ignore[attr-defined]
            box.step(8)
            box.solver.poll()
        disturb()
        assert box.solver.batch.replay.under_way is None  # type: ignore[attr-defined]
        box.settle()
        assert abs(box.book.imbalance_share) < CONTACTS
    assert not box.solver.batch.replay.all_again  # type: ignore[attr-defined]


def test_leaves_follow_threshold_depth_and_budget(planted: Callable[..., Solution]) -> None:
    """All while the solution is running, which stays finite and keeps its energy."""
    box = planted(table_room(), **(SHADOW | {"depth": 2, "residual": 0.2, "gradient": 5.0}))

    def settled(**options: object) -> int:
        box.refine(**options)
        for _ in range(12):  # until the knob has been heard of
            box.step(8)
            box.solver.poll()
        box.settle()
        assert np.isfinite(box.H).all() and abs(box.book.imbalance_share) < CONTACTS
        return len(box.lightmap.refinement.tree)  # type: ignore[attr-defined]

    few = settled()
    stay = settled(gradient=5.0 * MERGE)  # leaves that do not merge where the threshold is 5
    many = settled(gradient=0.2)
    assert few <= stay < many
    assert few < settled(depth=1) < many
    assert few <= settled(depth=2, gradient=5.0) <= stay
    full = settled(depth=4, gradient=1e-3, budget=65_536)  # half of the room that is there from the start
    assert 65_536 // 256 - 3 <= full <= 65_536 // 256 and "65,536" in (box.solver.poll().note or "")


def test_an_edit_of_a_grown_tree(planted: Callable[..., Solution]) -> None:
    """The log of shots is scaled with the light: what is made again into later leaves fits what is there, within the error of
    form factors."""
    options = SHADOW | {"depth": 1, "residual": 0.05}
    box = planted(table_room(), **options)
    box.settle()
    H = finest_light(box)[0]
    materials = list(box.lightmap.scene.materials)
    materials[2] = grey(0.2, 5.0, double_sided=True)  # a quarter of the lamp's 20 W/m²
    box.solver.set_materials(tuple(materials))
    box.refine(depth=2)
    for _ in range(12):
        box.step(8)
        box.solver.poll()
    box.settle()
    finer, covered = finest_light(box)
    coarse = H.repeat(2, 0).repeat(2, 1)[: finer.shape[0], : finer.shape[1]] if finer.shape != H.shape else H
    assert finer[covered].mean() == pytest.approx(coarse[covered].mean() / 4, rel=FORM_FACTORS)
    assert abs(box.book.imbalance_share) < CONTACTS
