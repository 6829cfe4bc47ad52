"""The polygon that a patch shoots from is what its texels cover, where these end within a texel, too."""

import numpy as np
import pytest
from solver_scenes import begin, grey, quads_scene

from app.gpu import Gpu
from app.scene.model import F64

DENSITY = 8.0  # texels/m
# m, of a floor: its last texels are covered in part, at last so little that their moments are lost beside their place in a patch
SIZES = {"strips": (2.33, 2.17), "thin strips": (2 + 3e-3 / DENSITY,) * 2, "thinnest strips": (2 + 1e-3 / DENSITY,) * 2}


def corners_of(record: np.void) -> F64:
    """(4, 3) of a shooter's polygon, solver space."""
    u, v = (record[name].astype(np.float64) / 2 for name in ("edge_u", "edge_v"))
    return record["centre"] + np.array([-u - v, u - v, u + v, -u + v])


@pytest.mark.parametrize(("wide", "deep"), SIZES.values(), ids=SIZES)
def test_patches_of_a_strip_tile_it(gpu: Gpu, wide: float, deep: float) -> None:
    """An L, which is no rectangle, so that its texels are not fitted to it."""
    main = [(0, 0, 0), (0, 0, 1), (wide, 0, 1), (wide, 0, 0)]
    arm = [(0, 0, 1), (0, 0, deep), (1, 0, deep), (1, 0, 1)]
    solution = begin(gpu, quads_scene([main, arm], [grey(0.5)]), density=DENSITY)
    solution.light_up()
    space, surfaces = solution.lightmap.pool.space, solution.lightmap.pool.surfaces
    whole, lower, upper = surfaces.area.max(), [], []
    for x, y in solution.patches():
        shot = solution.solver.audit((int(x), int(y))).shot
        corners = space.world_from_local(corners_of(shot.record))
        low, high = corners.min(0), corners.max(0)
        if high[0] > 1 + 1e-3 and high[2] > 1 + 1e-3:
            continue  # it lies in the corner between the arms
        assert np.isclose((high - low)[[0, 2]].prod(), shot.area, rtol=1e-3)
        sides = np.array([4 / DENSITY, wide - 2, deep - 2])  # a patch has four texels a side, or the rest at a border
        assert np.isclose((high - low)[[0, 2], None], sides, rtol=1e-3, atol=0).any(1).all()
        assert low.min() > -1e-3 and high[0] < wide + 1e-3 and high[2] < deep + 1e-3
        lower.append(low[[0, 2]])
        upper.append(high[[0, 2]])
    assert (surfaces.area[surfaces.area > 0] < 0.9 * whole).sum() > 10
    overlaps = np.minimum(np.array(upper)[:, None], upper) - np.maximum(np.array(lower)[:, None], lower)
    overlaps = np.clip(overlaps, 0, None).prod(-1)
    assert overlaps.sum() - np.trace(overlaps) < 1e-3 * np.trace(overlaps)
    solution.release()
