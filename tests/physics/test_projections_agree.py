"""Every projection hands out all light, and they end at the same solution."""

from __future__ import annotations

import numpy as np
import pytest
from solver_scenes import UNIT_SQUARE, begin, grey, quads_scene, room, solve, table_room

from app.gpu import Gpu
from app.reference.metrics import relative_rms
from app.scene.load import load_scene
from app.visibility.projections import PROJECTIONS

EVERY_PROJECTION = pytest.mark.parametrize("projection", PROJECTIONS)


@EVERY_PROJECTION
def test_cornell_box_audits(gpu: Gpu, projection: str) -> None:
    """Open front, blocks, a lamp 0.1 mm under the ceiling: within 1 % in the mean over all patches, weighted by area. Where a
    block stands on a patch or cuts it, the patch's middle is a poor judge."""
    box = begin(gpu, load_scene("cornell-box"), texels=4000, projection=projection)
    box.light_up()
    audits = [box.solver.audit((int(x), int(y))) for x, y in box.patches()[::5]]
    total, area = (np.array(v) for v in zip(*((a.total, a.shot.area) for a in audits), strict=True))
    assert np.average(total, weights=area) == pytest.approx(1, abs=0.01)
    assert np.median(np.abs(total - 1)) < 0.005
    box.release()


@EVERY_PROJECTION
def test_a_lone_emitter_sends_everything_away(gpu: Gpu, projection: str) -> None:
    """Σ of the weights that escaped.frag.glsl uses: 1 within 1e-3, at the coarsest map as well."""
    for resolution in (64, 256):
        lamp = begin(
            gpu, quads_scene([UNIT_SQUARE], [grey(0.5, 1.0)]), texels=256, projection=projection, resolution=resolution
        )
        for audit in lamp.audits()[:1]:
            assert audit.open == pytest.approx(1, abs=1e-3)
        lamp.release()


def test_solutions_agree(gpu: Gpu) -> None:
    """A room with a shadow. Maps of other samples put the steps of a shadow's edge elsewhere: 2 % of the light on a texel, and
    nothing in the mean over an object."""
    H = {}
    for projection in PROJECTIONS:
        mine = solve(gpu, table_room(), density=5, residual=0.02, resolution=128, projection=projection)
        H[projection] = mine.H, mine.means(mine.H)
        mine.release()
    for texels, means in H.values():
        assert relative_rms(texels, H["hemicube"][0]) < 0.02
        np.testing.assert_allclose(means, H["hemicube"][1], rtol=0.01)


# -- small triangles ---------------------------------------------------------------------------------------------------


@EVERY_PROJECTION
def test_small_triangles_do_not_vanish(gpu: Gpu, projection: str) -> None:
    """A speck in a room, seen under a tenth of a sample's width: every shooter that does not see it edge-on has it in its map."""
    speck = (UNIT_SQUARE - 0.5) * 0.002 + [0.4, 0.55, 0.6]
    scene = quads_scene([*room(), speck], [grey(0.5), grey(0.5, double_sided=True)], [0] * 6 + [1])
    solution = begin(gpu, scene, texels=400, projection=projection, resolution=64)
    charts = solution.lightmap.charts
    items = charts.face_facet[charts.face_triangle >= 12] + 1
    solution.light_up()
    vanished = []
    for x, y in solution.patches():
        audit = solution.solver.audit((int(x), int(y)))
        height = abs(audit.shot.centre[2] - 0.6)
        if audit.shot.area < 1e-3 or height < 0.05:  # of the speck itself, or edge-on
            continue
        seen = np.frombuffer(solution.solver.sight(audit.shot)["items"].read(), np.float32)
        assert np.isin(seen, items).any()
        vanished.append(solution.solver.vanished(audit.shot))
    assert max(vanished) == 2 and np.mean(vanished) > 1.5  # of two triangles; a sample may hit one by chance
    solution.release()


def test_nothing_large_vanishes(gpu: Gpu) -> None:
    box = begin(gpu, load_scene("furnace"), texels=400)
    box.light_up()
    for x, y in box.patches():
        shot = box.solver.audit((int(x), int(y))).shot
        assert box.solver.vanished(shot) == 0
    box.release()
