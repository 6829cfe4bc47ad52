"""Which sides get texels, and which triangles are one flat surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from atlas_scenes import TURN, box_room, moved, scene_of, split_grid

from app.atlas.enclosed import without_enclosed
from app.atlas.facets import facets
from app.atlas.parametrize import parametrize
from app.atlas.points import SideIndex, random_points
from app.atlas.rectangles import find_rectangles
from app.atlas.sides import lit_sides, scene_size, weld
from app.scene import shapes
from app.scene.model import Camera, Light, Material, Scene
from app.scene.shapes import Mesh

BOTH = Material("both", double_sided=True)
FRONT = Material("front")


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize(
    ("mesh", "material", "fronts", "backs", "dark"),
    [
        (box_room(), BOTH, 12, 0, 12),  # a closed room seen from inside: outside is dark
        (shapes.box((1, 2, 3)), BOTH, 0, 12, 12),
        (box_room(), FRONT, 12, 0, 0),
        (shapes.merged([box_room(), shapes.box((1, 1, 1))]), BOTH, 24, 12, 12),  # the inner box also has an inside
        (shapes.merged([shapes.box((1, 1, 1)), shapes.box((1, 1, 1)).moved(3, 0, 0)]), FRONT, 4, 0, 20),
        (shapes.icosphere(1.0, 2), BOTH, 0, 320, 320),
        (shapes.quad((0, 0, 0), (1, 0, 0), (0, 1, 0)), BOTH, 2, 2, 0),  # nothing faces anything: all are kept
    ],
)
def test_sides_with_something_in_front(
    mesh: Mesh, material: Material, fronts: int, backs: int, dark: int, scale: float
) -> None:
    scene = moved(scene_of([mesh], [material]), TURN @ np.diag([scale, scale, scale, 1.0]))
    sides = lit_sides(scene)
    assert (np.count_nonzero(~sides.back), np.count_nonzero(sides.back), sides.dark) == (fronts, backs, dark)
    for way in (False, True):
        assert (np.diff(sides.triangle[sides.back == way]) > 0).all()


BOX, BALL = shapes.box((1, 1, 1)), shapes.icosphere(0.5, 1)
LAMP = Material("lamp", emission=(1.0, 1.0, 1.0), double_sided=True)
EYE = Camera("eye", np.block([[np.eye(3), np.array([[3.1], [0.2], [0.1]])], [np.zeros((1, 3)), np.ones((1, 1))]]), 1.0)


@pytest.mark.parametrize(
    ("mesh", "material", "more", "within"),
    [
        (BOX, BOTH, {}, 24),
        (BOX.flipped(), BOTH, {}, 24),  # whichever way its triangles turn
        (BALL, LAMP, {}, 160),
        (BOX, FRONT, {}, 0),  # whose insides are none
        (shapes.box((1, 1, 1), without=["bottom"]), BOTH, {}, 0),
        (shapes.merged([BOX, BALL.transformed(np.diag([0.5, 0.5, 0.5, 1.0]))]), BOTH, {}, 2 * 80),  # the ball alone
        (BOX, Material("glass", opacity=0.5, double_sided=True), {}, 0),
        (BOX, BOTH, {"cameras": (EYE,)}, 12),
        (BOX, BOTH, {"lights": (Light("lamp", "point"),)}, 0),
    ],
)
def test_insides_of_closed_bodies(mesh: Mesh, material: Material, more: dict[str, object], within: int) -> None:
    """Of two that see each other; one of them has what is within it."""
    scene = replace(scene_of([mesh, mesh.moved(3, 0, 0)], [material]), **more)
    lit = lit_sides(scene)
    left = without_enclosed(lit, scene, *weld(scene))
    assert left.dark - lit.dark == len(lit.triangle) - len(left.triangle) == within
    if within == 2 * len(mesh.triangles):
        out = np.where(left.back, -1.0, 1.0)[:, None] * scene.normals_areas[0][left.triangle]
        middle = scene.corners[left.triangle].mean(1)
        centre = mesh.positions.mean(0) + 3.0 * (left.triangle >= len(mesh.triangles))[:, None] * [1, 0, 0]
        assert (((middle - centre) * out).sum(1) > 0).all()


def test_random_points_lie_where_there_are_texels() -> None:
    scene = scene_of([BOX, BOX.moved(3, 0, 0)], [BOTH])
    points, charts = random_points(scene, 200, 1), parametrize(scene, texels=500)
    assert (SideIndex(charts.face_triangle, charts.face_back).of(points) >= 0).all() and len(points) == 200


def test_a_coplanar_neighbour_lights_nothing() -> None:
    floor = shapes.quad((0, 0, 0), (0, 0, 1), (1, 0, 0))
    lamp = shapes.quad((5, 2, 0), (1, 0, 0), (0, 0, 1))
    sides = lit_sides(scene_of([floor, floor.moved(2, 0, 0), lamp], [BOTH]))
    assert sides.triangle.tolist() == [0, 1, 2, 3, 4, 5]  # floors up, the lamp down; all backs look away
    assert not sides.back.any()


def _facet_sizes(scene: Scene) -> list[int]:
    points, corners = weld(scene)
    label = facets(points, corners, scene.material_ids, scene_size(scene))
    return sorted(np.bincount(label).tolist())


SHEET = shapes.quad((0, 0, 0), (2, 0, 0), (0, 1, 0))


@pytest.mark.parametrize(
    ("meshes", "materials", "sizes"),
    [
        ([shapes.box((1, 1, 1))], [FRONT], [2] * 6),
        ([split_grid(SHEET, 3, 2)], [FRONT], [12]),
        ([SHEET, SHEET.moved(2, 0, 0)], [FRONT, Material("other")], [2, 2]),
        ([SHEET, SHEET.moved(2, 1, 0)], [FRONT], [2, 2]),  # they meet in a corner only
        ([SHEET, SHEET.flipped().moved(2, 0, 0)], [FRONT], [2, 2]),  # they look in opposite directions
        ([SHEET, split_grid(SHEET.moved(2, 0, 0), 1, 3)], [FRONT], [8]),  # one long edge against three short ones
        ([SHEET, SHEET], [FRONT], [1, 1, 1, 1]),  # sheets that coincide never share a chart
        ([shapes.icosphere(1.0, 3)], [FRONT], [1] * 1280),
    ],
)
def test_facets(meshes: list[Mesh], materials: list[Material], sizes: list[int]) -> None:
    assert _facet_sizes(moved(scene_of(meshes, materials), TURN)) == sizes


def test_a_surface_that_bends_little_by_little_is_not_one_facet() -> None:
    # 0.0003 rad from each strip to the next passes for flat, 0.3 rad in all does not
    angle = np.arange(1001) * 3e-4
    x = np.concatenate([[0.0], np.cumsum(np.cos(angle))])
    y = np.concatenate([[0.0], np.cumsum(np.sin(angle))])
    strips = [
        shapes.quad((x[k], y[k], 0), (x[k + 1] - x[k], y[k + 1] - y[k], 0), (0, 0, 400)) for k in range(len(angle))
    ]
    assert max(_facet_sizes(scene_of(strips))) == 1


def _rectangles(scene: Scene) -> list[list[float]]:
    points, corners = weld(scene)
    label = facets(points, corners, scene.material_ids, scene_size(scene))
    r = find_rectangles(points, corners, scene.material_ids, label)
    assert np.allclose(np.einsum("rk,rk->r", r.u, r.v), 0, atol=1e-12)
    assert (r.size[:, 0] >= r.size[:, 1] * (1 - 1e-4)).all()  # a square within the code's own tolerance is a square
    sums = np.zeros((len(r.facet), 3))
    for k, f in enumerate(r.facet):
        a, b, c = np.moveaxis(points[corners[label == f]], 1, 0)
        sums[k] = np.cross(b - a, c - a).sum(axis=0)
    assert (np.einsum("rk,rk->r", np.cross(r.u, r.v), sums) > 0).all()
    return np.concatenate([r.corner, r.u * r.size[:, :1], r.v * r.size[:, 1:]], axis=1).tolist()


WAYS = {
    "two triangles": SHEET,
    "other diagonal": split_grid(SHEET, 1, 1, flip_diagonal=True),
    "grid": split_grid(SHEET, 5, 3),
    "fan": Mesh(
        np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0.7, 0.2, 0]], float),
        np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]),
        np.zeros((5, 2)),
    ),
    "cut on one side only": shapes.merged(
        [shapes.quad((0, 0, 0), (1, 0, 0), (0, 1, 0)), split_grid(shapes.quad((1, 0, 0), (1, 0, 0), (0, 1, 0)), 2, 3)]
    ),
    "diagonal cut on one side": Mesh(
        np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [1, 0.5, 0]], float),
        np.array([[0, 1, 2], [0, 4, 3], [4, 2, 3]]),
        np.zeros((5, 2)),
    ),
}


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("way", WAYS)
def test_a_rectangle_is_the_same_however_it_is_cut(way: str, scale: float) -> None:
    place = TURN @ np.diag([scale, scale, scale, 1.0])
    wall = shapes.quad((-1, -1, 3), (5, 0, 0), (0, 5, 0))
    expected = _rectangles(moved(scene_of([wall, SHEET]), place))
    order = np.random.default_rng(1).permutation(len(WAYS[way].triangles))
    mesh = Mesh(WAYS[way].positions, WAYS[way].triangles[order], WAYS[way].uv)
    found = _rectangles(moved(scene_of([wall, mesh]), place))
    assert len(found) == len(expected) == 2
    # welding may move a vertex by 1e-7 of the scene, which is 8 across
    assert np.allclose(sorted(found), sorted(expected), atol=1e-6 * scale, rtol=0)


NOT_RECTANGLES = {
    "triangle": Mesh(np.eye(3), np.array([[0, 1, 2]]), np.zeros((3, 2))),
    "trapezium": shapes.polygon([(0, 0, 0), (2, 0, 0), (1.99, 1, 0), (0, 1, 0)]),
    "parallelogram": shapes.quad((0, 0, 0), (2, 0, 0), (0.1, 1, 0)),
    "L": shapes.merged([SHEET, shapes.quad((0, 1, 0), (1, 0, 0), (0, 1, 0))]),
    "bent quad": shapes.polygon([(0, 0, 0), (2, 0, 0), (2, 1, 0.01), (0, 1, 0)]),
}


@pytest.mark.parametrize("name", NOT_RECTANGLES)
def test_what_is_no_rectangle(name: str) -> None:
    assert _rectangles(moved(scene_of([NOT_RECTANGLES[name]]), TURN)) == []
