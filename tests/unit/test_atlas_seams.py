"""Seams: where a smooth surface goes on in another chart, and that light does, too."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import shapely
import trimesh
from numpy.typing import NDArray
from solver_scenes import grey, quads_scene, room

from app.atlas.charts import Charts
from app.atlas.cuts import cut_at_contacts
from app.atlas.parametrize import parametrize
from app.atlas.seams import seam_texels
from app.lightmap.collapse import collapse
from app.lightmap.gutter import fill_gutter
from app.lightmap.seams import finished, jumps
from app.lightmap.tile_pool import TilePool
from app.scene.model import F32, F64, Scene
from app.scene.validate import Part, validate

SCREEN = [(1.0, 0, 0.3), (1.0, 0.5, 0.3), (1.0, 0.5, 0.6), (1.0, 0, 0.6)]


def with_screen() -> Scene:
    """A room whose floor is parted by a screen, and goes on beside it."""
    return quads_scene([*room((2.0, 1.0, 1.0)), SCREEN], [grey(0.5, double_sided=True)])


def ball() -> Scene:
    walls, sphere = quads_scene(room(), [grey(0.5)]), trimesh.creation.icosphere(3, 0.3)
    parts = [Part(walls.positions, walls.triangles), Part(np.add(sphere.vertices, 0.5), sphere.faces)]
    return validate("ball", "ball", parts, ["ball"], [grey(0.5)])


def lit(scene: Scene) -> tuple[F32, NDArray[np.bool_], Charts]:
    """An image of light that changes evenly over space, where texels cover something, charts."""
    cut = cut_at_contacts(scene)
    pool = TilePool(cut.scene, parametrize(cut.scene, density=16.0, ends=cut.ends))
    light = 1 + pool.surfaces.position @ [1.0, 0.3, 0.7]
    return *collapse(pool, np.repeat(light[..., None], 3, 3).astype(np.float32)), pool.charts


def test_light_goes_on_across_seams() -> None:
    """Where it changes evenly, on a plane: by interpolation exactly, but for where a seam ends."""
    image, covered, charts = lit(with_screen())
    assert len(charts.seams) > 0
    before, after = (jumps(one, charts) for one in (fill_gutter(image, covered), finished(image, covered, charts)))
    assert before.across[0] > 0.2 * before.within[0], "or there is nothing to be seen"
    assert after.across[0] < 0.02 * after.within[0] and after.across[1] < 0.2 * after.within[1]


def test_light_goes_on_around_a_ball() -> None:
    image, covered, charts = lit(ball())
    before, after = (jumps(one, charts) for one in (fill_gutter(image, covered), finished(image, covered, charts)))
    assert before.places > 100 and before.across[0] > 2 * after.across[0]
    assert after.across[0] < 0.25 * after.within[0] and after.across[1] < 0.5 * after.within[1]


def test_seams_lie_where_nothing_stands() -> None:
    """Beside the screen, not at its foot; and from both sides."""
    _, _, charts = lit(with_screen())
    half = len(charts.seams) // 2
    lengths = np.linalg.norm(np.diff(charts.seams.own, axis=1), axis=2).reshape(-1) / charts.density
    assert lengths[:half].sum() == pytest.approx(1.0 - 0.3, rel=1e-6)
    np.testing.assert_array_equal(charts.seams.own[half:], charts.seams.other[:half, ::-1])
    wall = [(x, y, round(z)) for x, y, z in SCREEN]
    _, _, charts = lit(quads_scene([*room((2.0, 1.0, 1.0)), wall], [grey(0.5, double_sided=True)]))
    assert len(charts.seams) == 2 * 2, "on both long walls, above it"


def test_light_jumps_where_something_stands_up_to_where_a_seam_begins() -> None:
    """Texels of the foot of the screen that lie near the end of a seam are not part of it."""
    _, _, charts = lit(with_screen())
    near = seam_texels(charts.seams)

    def distance(edges: F64) -> NDArray[np.float64]:
        return np.asarray(shapely.distance(shapely.points(near.texel + 0.5), shapely.multilinestrings(list(edges))))

    assert len(near.texel) and len(charts.seams.jumps)
    assert (distance(charts.seams.own) <= distance(charts.seams.jumps) + 1e-9).all()


def test_a_crease_is_no_seam() -> None:
    """Nor is the edge of another material; vertex normals, where there are any, have the last word."""
    bent = [[(0, 0, 0), (0, 0, 1), (1, 0, 1), (1, 0, 0)], [(1, 0, 0), (1, 0, 1), (1.9, 0.3, 1), (1.9, 0.3, 0)]]
    roof = [(0, 2, 0), (2, 2, 0), (2, 2, 1), (0, 2, 1)]
    materials = [grey(0.5), grey(0.4)]
    scene = quads_scene([*bent, roof], materials, [0, 0, 0])
    seams = parametrize(scene, texels=3000).seams
    assert len(seams) == 2
    assert len(parametrize(quads_scene([*bent, roof], materials, [0, 1, 0]), texels=3000).seams) == 0
    flat = np.repeat(scene.normals_areas[0][:, None], 3, axis=1).astype(np.float32)
    assert len(parametrize(dataclasses.replace(scene, normals=flat), texels=3000).seams) == 0
    up = np.broadcast_to(np.float32([0, 1, 0]), flat.shape)
    steep = quads_scene([bent[0], [(1, 0, 0), (1, 0, 1), (1.1, 0.9, 1), (1.1, 0.9, 0)], roof], materials, [0, 0, 0])
    assert len(parametrize(steep, texels=3000).seams) == 0
    assert len(parametrize(dataclasses.replace(steep, normals=up), texels=3000).seams) == 2


def test_where_there_are_no_seams_nothing_changes() -> None:
    image, covered, charts = lit(quads_scene(room(), [grey(0.5)]))
    np.testing.assert_array_equal(finished(image, covered, charts), fill_gutter(image, covered))
    assert jumps(image, charts).places == 0
