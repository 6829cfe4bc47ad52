"""The surface under every texel, against plain geometry and a slow polygon clipper."""

from __future__ import annotations

import time

import numpy as np
import pytest
from atlas_scenes import TURN, box_room, face_areas, moved, own_cache, scene_of, split_grid

from app.atlas.charts import DEFAULT_TILE, Charts
from app.atlas.parametrize import parametrize
from app.atlas.texels import Leaves, faces_tangents, texel_surfaces, uniform_leaves
from app.scene import shapes
from app.scene.model import F64, Material, Scene

__all__ = ["own_cache"]

BOTH = Material("both", double_sided=True)
SCENES = {
    "room": moved(scene_of([box_room()], [BOTH]), TURN),
    "cut room": moved(
        scene_of([box_room(), split_grid(shapes.quad((-1, -1, 0), (2, 0, 0), (0, 2, 0)), 7, 5)], [Material("a"), BOTH]),
        TURN,
    ),
    "ball": scene_of([box_room(), shapes.icosphere(0.7, 3)], [Material("wall"), BOTH]),
    "drum": moved(scene_of([box_room(), shapes.cylinder(0.7, 1.0, 48)], [Material("wall"), BOTH]), TURN),
    "triangle": scene_of([shapes.Mesh(np.eye(3), np.array([[0, 1, 2]]), np.zeros((3, 2)))], [BOTH]),
}


@pytest.mark.parametrize("texels", [200, 9000])
@pytest.mark.parametrize("level", [0, 1, 3])
@pytest.mark.parametrize("name", SCENES)
def test_areas_sum_to_the_surface(name: str, level: int, texels: int) -> None:
    scene = SCENES[name]
    charts = parametrize(scene, texels=texels)
    leaves = uniform_leaves(charts, level)
    surfaces = texel_surfaces(scene, charts, leaves)
    assert ((surfaces.area > 0) == (surfaces.face >= 0)).all()
    # exact but for slivers under 1e-9 of their texel
    assert np.isclose(surfaces.area.sum(), face_areas(scene, charts).sum(), rtol=1e-9)
    assert (surfaces.area.reshape(len(leaves), -1).max(axis=1) > 0).all(), "a leaf that nothing covers"
    covered = surfaces.face >= 0
    assert np.allclose(np.linalg.norm(surfaces.normal[covered], axis=1), 1, atol=1e-6)  # float32


@pytest.mark.parametrize("name", ["room", "cut room", "triangle"])
def test_texels_of_flat_charts_lie_on_their_face(name: str) -> None:
    scene = SCENES[name]
    charts = parametrize(scene, texels=5000)
    surfaces = texel_surfaces(scene, charts, uniform_leaves(charts))
    covered = surfaces.face >= 0
    triangle = charts.face_triangle[surfaces.face[covered]]
    normal = scene.normals_areas[0][triangle]
    off = np.einsum("nk,nk->n", surfaces.position[covered] - scene.corners[triangle, 0], normal)
    assert np.abs(off).max() < 1e-12  # float64 in a room of 7 m
    side = np.where(charts.face_back[surfaces.face[covered]], -1, 1)[:, None]
    assert np.allclose(surfaces.normal[covered], side * normal, atol=1e-6)  # float32


def test_back_sides_look_the_other_way() -> None:
    sheet = shapes.quad((-1, 0, -1), (0, 0, 2), (2, 0, 0))
    charts_of = [parametrize(scene_of([box_room(), sheet], [Material("wall"), m]), texels=4000) for m in (BOTH,)]
    scene = scene_of([box_room(), sheet], [Material("wall"), BOTH])
    surfaces = texel_surfaces(scene, charts_of[0], uniform_leaves(charts_of[0]))
    on_sheet = (surfaces.face >= 0) & (charts_of[0].face_triangle[surfaces.face] >= 12)
    up = surfaces.normal[on_sheet][:, 1]
    assert set(np.unique(np.round(up, 6))) == {-1.0, 1.0}
    assert np.isclose(surfaces.area[on_sheet][up > 0].sum(), 4.0) and np.isclose(
        surfaces.area[on_sheet][up < 0].sum(), 4.0
    )


@pytest.mark.parametrize("name", ["room", "cut room"])
def test_tangents_lead_from_texel_to_texel(name: str) -> None:
    scene = SCENES[name]
    charts = parametrize(scene, texels=5000)
    leaves = uniform_leaves(charts)
    surfaces = texel_surfaces(scene, charts, leaves)
    dpdu, dpdv = faces_tangents(scene, charts)
    size = np.linalg.norm(dpdu, axis=1) * np.linalg.norm(dpdv, axis=1)
    assert np.allclose(np.einsum("fk,fk->f", dpdu, dpdv), 0, atol=1e-12)
    for axis, step in ((1, dpdv), (2, dpdu)):
        first, second = range(charts.tile - 1), range(1, charts.tile)
        here, there = surfaces.face.take(first, axis), surfaces.face.take(second, axis)
        p = surfaces.position.take(second, axis) - surfaces.position.take(first, axis)
        same = (here >= 0) & (there >= 0)
        same[same] = charts.face_chart[here[same]] == charts.face_chart[there[same]]
        assert np.allclose(p[same], step[here[same]], atol=1e-10)  # whole texels of rectangles: float64 only
    full = surfaces.face >= 0
    assert np.allclose(surfaces.area[full], size[surfaces.face[full]], rtol=1e-9)


def _clipped(polygon: list[F64], axis: int, bound: float, keep_below: bool) -> list[F64]:
    """Sutherland and Hodgman 1974, one edge of the square."""
    out = []
    for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        dp, dq = ((v[axis] - bound) * (-1 if keep_below else 1) for v in (p, q))
        if dp >= 0:
            out.append(p)
        if dp * dq < 0:
            out.append(p + (q - p) * dp / (dp - dq))
    return out


def _area_and_centroid(triangle: F64, x: float, y: float, size: float) -> tuple[float, F64]:
    polygon = list(triangle)
    for axis, low in ((0, x), (1, y)):
        polygon = _clipped(polygon, axis, low, False)
        polygon = _clipped(polygon, axis, low + size, True) if polygon else polygon
    if len(polygon) < 3:
        return 0.0, np.zeros(2)
    p = np.array(polygon) - polygon[0]
    a, b = p[1:-1], p[2:]
    parts = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    if abs(parts.sum()) == 0:
        return 0.0, np.zeros(2)
    return abs(parts.sum()), polygon[0] + (parts[:, None] * (a + b) / 3).sum(axis=0) / parts.sum()


def _random_charts(rng: np.random.Generator, scale: float) -> tuple[Scene, Charts]:
    """One triangle of random shape at a random place in an atlas of 2×2 tiles, flat in the plane z = 0."""
    uv = np.clip(16 + scale * rng.normal(size=(1, 3, 2)), 0, 32)
    scene = Scene(
        "one",
        np.concatenate([uv[0], np.zeros((3, 1))], axis=1),
        np.array([[0, 1, 2]], np.int32),
        *(np.zeros(1, np.int32),) * 2,
        ("o",),
        (Material("m"),),
    )
    zero = np.zeros(1, np.int32)
    rects = np.array([[0, 0, 32, 32]], np.int32)
    return scene, Charts((32, 32), DEFAULT_TILE, 1.0, zero, np.zeros(1, bool), uv, zero, zero, rects, 0, "test")


@pytest.mark.parametrize("scale", [0.01, 0.5, 3.0, 12.0])
def test_against_a_slow_clipper_on_mixed_leaves(scale: float) -> None:
    rng = np.random.default_rng(int(100 * scale))
    # one tile of level 0, one cut into four, one cut to level 2 in one quarter, one missing
    tiles = [
        (0, 0, 0),
        *[(1, 2 + i, j) for i in (0, 1) for j in (0, 1)],
        *[(1, i, 2 + j) for i, j in ((0, 0), (1, 0), (1, 1))],
    ]
    tiles += [(2, 0 + i, 6 + j) for i in (0, 1) for j in (0, 1)]
    leaves = Leaves(*(np.array(column, np.int32) for column in zip(*tiles, strict=True)))
    for _ in range(8):
        scene, charts = _random_charts(rng, scale)
        surfaces = texel_surfaces(scene, charts, leaves)
        for n, (level, tx, ty) in enumerate(tiles):
            size = 0.5**level
            for row in range(charts.tile):
                for column in range(charts.tile):
                    x, y = (tx * charts.tile + column) * size, (ty * charts.tile + row) * size
                    area, centroid = _area_and_centroid(charts.face_uv[0], x, y, size)
                    if area < 2e-9 * size**2:  # what counts as rounding
                        assert surfaces.area[n, row, column] < 4e-9 * size**2
                        continue
                    assert np.isclose(surfaces.area[n, row, column], area, rtol=1e-6, atol=1e-12)
                    # a fragment's centroid is good to its thinness: 1e-15 over 2e-9
                    assert np.allclose(surfaces.position[n, row, column, :2], centroid, atol=1e-5)


def test_leaves_are_the_tiles_that_are_covered_row_by_row() -> None:
    scene = SCENES["ball"]
    charts = parametrize(scene, texels=20_000)
    for level in (0, 2):
        leaves = uniform_leaves(charts, level)
        order = leaves.y.astype(np.int64) * 10**6 + leaves.x
        assert (np.diff(order) > 0).all() and (leaves.level == level).all()
        everywhere = np.indices((charts.size[1] * 2**level // charts.tile, charts.size[0] * 2**level // charts.tile))
        y, x = everywhere.reshape(2, -1).astype(np.int32)
        full = texel_surfaces(scene, charts, Leaves(np.full(len(x), level, np.int32), x, y))
        used = np.flatnonzero((full.face >= 0).any(axis=(1, 2)))
        assert (x[used] == leaves.x).all() and (y[used] == leaves.y).all()


def test_a_texel_sums_all_its_triangles() -> None:
    scene = scene_of([box_room(), split_grid(shapes.quad((-1, -1, 0), (2, 0, 0), (0, 2, 0)), 3, 1)])
    charts = parametrize(scene, texels=1)
    surfaces = texel_surfaces(scene, charts, uniform_leaves(charts))
    on_sheet = (surfaces.face >= 0) & (charts.face_triangle[surfaces.face] >= 12)
    assert on_sheet.sum() == 1  # six triangles in one texel, and its centroid in the middle
    assert np.allclose(surfaces.position[on_sheet], (0, 0, 0), atol=1e-12)
    assert np.isclose(surfaces.area[on_sheet].item(), 4.0)


def test_texels_in_the_shape_of_an_L_look_from_where_they_are() -> None:
    """Around the corner of a hole the centroid of a texel lies in the hole."""
    corners = np.array([(0, 0, 0), (2, 0, 0), (2, 0.2, 0), (0.2, 0.2, 0), (0.2, 2, 0), (0, 2, 0)])
    around = shapes.Mesh(corners, np.array([(0, k, k + 1) for k in range(1, 5)]), corners[:, :2])
    scene = scene_of([box_room().moved(0, 0, 1.5), around])
    for texels in (1, 12):
        charts = parametrize(scene, texels=texels)
        surfaces = texel_surfaces(scene, charts, uniform_leaves(charts))
        mine = (surfaces.face >= 0) & (scene.object_ids[charts.face_triangle[surfaces.face]] > 0)
        assert mine.any() and (surfaces.position[mine][:, :2].min(1) < 0.2 + 1e-9).all()


@pytest.mark.parametrize("larger_first", [True, False])
def test_the_largest_share_decides_in_any_order(larger_first: bool) -> None:
    large, small = shapes.quad((0, 0, 0), (1.9, 0, 0), (0, 2, 0)), shapes.quad((1.9, 0, 0), (0.1, 0, 0), (0, 2, 0))
    pieces = [large, small] if larger_first else [small, large]
    scene = scene_of([box_room().moved(0, 0, 1), *pieces])
    charts = parametrize(scene, texels=1)
    surfaces = texel_surfaces(scene, charts, uniform_leaves(charts))
    owner = scene.object_ids[charts.face_triangle[surfaces.face[surfaces.face >= 0]]]
    assert (1 if larger_first else 2) in owner and (2 if larger_first else 1) not in owner


def test_speed() -> None:
    scene = SCENES["room"]
    charts = parametrize(scene, texels=400_000)
    start = time.process_time()
    surfaces = texel_surfaces(scene, charts, uniform_leaves(charts))
    # 0.3 s measured; the limit asks 1.6 million rectangle texels in 3 s, with room for a busy machine
    assert time.process_time() - start < 1.5
    assert (surfaces.face >= 0).sum() > 340_000
