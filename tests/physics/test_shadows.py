"""Light does not pass through walls, nor to the back of what has only a front."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from solver_scenes import EVERY_SOLVER, UNIT_SQUARE, grey, quads_scene, room, solve

from app.gpu import Gpu
from app.scene.model import Camera
from app.solvers.shooting.options import VISIBILITIES
from app.visibility.projections import PROJECTIONS

RAYS = "rays"  # in place of a way to look at maps: no map, no sample of one that grazes
HEMISPHERES = [name for name in PROJECTIONS if name != "hemicube"]
LAMP = np.array(
    [[-0.5, 1.5, -1.0], [-0.5, 1.5, 1.5], [-0.5, 0.5, 1.5], [-0.5, 0.5, -1.0]]
)  # beside the unit box, faces +x


def way(visibility: str, projection: str = "hemicube") -> dict[str, object]:
    """Options of a solve."""
    return {"solver": "gathering"} if visibility == RAYS else {"visibility": visibility, "projection": projection}


# maps are drawn of the scene, and looked at point by point, whatever its texels: of quadtrees one way of each kind is enough
UNIFORM = [*((v, "hemicube") for v in VISIBILITIES), *(("combined", p) for p in HEMISPHERES), (RAYS, "none")]
QUADTREES = [("combined", "hemicube"), (RAYS, "none")]


@pytest.mark.parametrize(
    ("adaptive", "visibility", "projection"), [*((False, *w) for w in UNIFORM), *((True, *w) for w in QUADTREES)]
)
@pytest.mark.parametrize("double_sided", [False, True], ids=["black outside", "white outside"])
@pytest.mark.parametrize("shift", [0.0, 0.013], ids=["in line", "out of line"])
def test_nothing_inside_a_closed_box_from_a_lamp_outside(
    gpu: Gpu, adaptive: bool, visibility: str, projection: str, double_sided: bool, shift: float
) -> None:
    """The walls are as thin as can be, and patches of the lamp lie in the planes of floor and walls. A camera is within, so that
    the inside has texels."""
    scene = quads_scene([*room(), LAMP + shift], [grey(0.5, double_sided=double_sided), grey(0.0, 1.0)], [0] * 6 + [1])
    eye = np.eye(4)
    eye[:3, 3] = 0.5
    scene = replace(scene, cameras=(Camera("within", eye, 1.0),))
    box = solve(gpu, scene, texels=2000, residual=0.05, adaptive=adaptive, **way(visibility, projection))
    inside = (box.object < 6) & (((0.5 - box.position) * box.normal).sum(1) > 0)
    assert inside.sum() > 500
    leak = (box.H[inside, 0] * box.area[inside]).sum() / box.book.emitted[0]
    if visibility in ("item-id", RAYS):
        assert leak == 0  # no sample of the map shows an inner face
    else:
        # What a sample shows beyond a receiver's plane lets it see the receiver: where sight grazes a wall's rim, in its very
        # plane, half of the samples pass it. That is the width of one sample, 1/128, along two of the box's rims.
        assert leak < 3e-3
    box.release()


@EVERY_SOLVER
def test_a_lamp_has_only_a_front(gpu: Gpu, solver: str) -> None:
    """A one-sided lamp between two boards lights the one in front of it."""
    boards = [UNIT_SQUARE, np.add(UNIT_SQUARE[::-1], [0.0, 0.0, 2.0])]  # face each other
    lamp = UNIT_SQUARE * 0.5 + [0.25, 0.25, 1.0]  # faces +z
    scene = quads_scene([*boards, lamp], [grey(0.0), grey(0.0, 1.0)], [0, 0, 1])
    box = solve(gpu, scene, density=16, solver=solver)
    H = box.means(box.H)[:, 0]
    assert H[0] == 0
    assert H[1] > 0.05
    box.release()


@pytest.mark.parametrize("visibility", [*VISIBILITIES, RAYS])
def test_nothing_behind_a_thin_wall(gpu: Gpu, visibility: str) -> None:
    """A room with a partition from wall to wall, of one sheet that is white on both sides."""
    sheet = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [1.0, 0.0, 1.0]])  # faces +x
    walls = room((2.0, 1.0, 1.0))
    lamp = UNIT_SQUARE[:, [0, 2, 1]] * [0.4, 1.0, 0.4] + [1.3, 0.9, 0.3]  # faces down
    scene = quads_scene(
        [*walls, sheet, lamp], [grey(0.7), grey(0.7, double_sided=True), grey(0.0, 10.0)], [0] * 6 + [1, 2]
    )
    box = solve(gpu, scene, density=12, residual=0.05, **way(visibility))
    dark = (box.position[:, 0] < 1 - 1e-6) | ((box.object == 6) & (box.normal[:, 0] < 0))
    H = box.H[:, 0]
    assert H[~dark].mean() > 0.5
    if visibility == RAYS:
        assert H[dark].max() == 0
    # floor and ceiling pass below the sheet as one facet: within a sample of the map, 1/128, of its foot
    assert H[dark].max() < 1e-3 * H[~dark].mean()
    assert (H * box.area)[dark].sum() < 1e-5 * (H * box.area)[~dark].sum()
    box.release()
