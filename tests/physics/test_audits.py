"""Patches are audited before they shoot: those that would lose or make light shoot from finer ones."""

from __future__ import annotations

import numpy as np
import pytest
from solver_scenes import EVERY_LIGHTMAP, begin, grey, quads_scene, room

from app.gpu import Gpu
from app.scene.model import Scene


def coffered_room() -> Scene:
    """A closed room 3 × 3 × 3 with a lamp 1 × 1 on top of a shaft half a metre deep in its ceiling."""
    quads = [*room((3.0, 3.0, 3.0))]
    ceiling, (a, b, y, top) = quads.pop(1), (1.0, 2.0, 3.0, 3.5)
    low, high = ceiling[:, [0, 2]].min(), ceiling[:, [0, 2]].max()
    ring = [(low, low, high, a), (low, b, high, high), (low, a, a, b), (b, a, high, b)]  # x, z to x, z
    quads += [np.array([[x0, y, z0], [x1, y, z0], [x1, y, z1], [x0, y, z1]]) for x0, z0, x1, z1 in ring]
    shaft = np.add(room((b - a, top - y, b - a)), [a, y, a])
    return quads_scene([*quads, *shaft[1:]], [grey(0.5), grey(0.0, 10.0)], [0] * len(quads) + [1, 0, 0, 0, 0])


@EVERY_LIGHTMAP
@pytest.mark.usefixtures("undivided")
def test_a_lamp_in_a_shaft_shoots_from_finer_patches(gpu: Gpu, adaptive: bool) -> None:
    """From the middle of the lamp more of the room is in sight than from its edges: in large patches it would make light. What
    is left after audits is what they let pass, 2 % of a shot, and what weak shots lose."""
    scene = coffered_room()
    assert audited(gpu, scene, adaptive, audits=True) < 0.01
    assert audited(gpu, scene, adaptive, audits=False) > 0.02


def audited(gpu: Gpu, scene: Scene, adaptive: bool, *, audits: bool) -> float:
    """The imbalance of a solve."""
    lit = begin(gpu, scene, density=8, residual=0.05, level=3, adaptive=adaptive, audits=audits)
    lit.settle()
    finer, shot = lit.solver.batch.marks.levels.max(), lit.solver.last_shot
    assert lit.solver.poll().converged and shot.size == lit.solver.patch_edge(
        shot.corner
    )  # host and shaders agree on what shoots
    share = abs(lit.book.imbalance_share)
    lit.release()
    assert (finer > 0) == audits
    return share


@EVERY_LIGHTMAP
def test_patches_that_were_split_are_not_lost_at_another_level(gpu: Gpu, adaptive: bool) -> None:
    """All residual is in some patch, once, whatever was split before patches grew or shrank: with residuals of one sign,
    Σ |Σ r A| over patches is Σ r A over texels."""

    def in_patches() -> float:
        lit.solver.settle()
        bins = np.frombuffer(lit.solver.batch.bins.strongest.read(), np.float32).reshape(-1, 4)
        return float(bins[:, 3].sum(dtype=np.float64)) * lit.solver.batch.ledger.watt

    lit = begin(gpu, coffered_room(), density=8, adaptive=adaptive, level=2)
    lit.light_up()
    whole = lit.book.unshot.sum()
    assert in_patches() == pytest.approx(whole, rel=1e-4)
    split = [(x, y, lit.solver.patch_edge((x, y)), 1) for x, y in lit.patches()[::7].tolist()]
    lit.solver.batch.marks.divide_patches(split)
    assert in_patches() == pytest.approx(whole, rel=1e-4)
    lit.solver.set_options(lit.solver.options.replace(level=4))
    lit.solver.batch.marks.divide_patches(split)
    assert in_patches() == pytest.approx(whole, rel=1e-4)
    lit.release()


def test_a_lamp_that_shines_on_a_ceiling_near_by(gpu: Gpu) -> None:
    """3 cm under a ceiling of texels of 17 cm: patches at its edge see from their middle nothing but its back, or nothing of it,
    and 13 % of the light would be lost. Its back is lit to 10 %: light falls off within a texel there."""
    lamp = [[1.5, 2.97, 1.5], [2.5, 2.97, 1.5], [2.5, 2.97, 2.5], [1.5, 2.97, 2.5]]
    materials = [grey(0.7), grey(0.0, 40.0, double_sided=True)]
    scene = quads_scene([*room((4.0, 3.0, 4.0)), lamp], materials, [0] * 6 + [1])
    means = []
    for solver in ("shooting", "gathering"):
        solution = begin(gpu, scene, density=6, solver=solver)
        solution.settle()
        assert abs(solution.book.imbalance_share) < 0.01, solver
        means.append(solution.means(solution.H)[:, 0])
        solution.release()
    shot, gathered = means
    np.testing.assert_allclose(shot[:6], gathered[:6], rtol=0.05)
    assert shot[6] == pytest.approx(gathered[6], rel=0.1)
