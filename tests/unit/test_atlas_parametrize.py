"""A scene's charts: how many texels, where, and the same for the same surface."""

from __future__ import annotations

import re

import numpy as np
import pytest
from atlas_scenes import TURN, box_room, face_areas, moved, own_cache, scene_of, split_grid
from solver_scenes import grey, quads_scene, room

from app.atlas.charts import ALIGN, Charts
from app.atlas.parametrize import MAX_TEXELS, parametrize
from app.atlas.texels import faces_tangents, texel_surfaces, uniform_leaves
from app.errors import UserError
from app.scene import shapes
from app.scene.model import Material, Scene

__all__ = ["own_cache"]

BOTH = Material("both", double_sided=True)
CLUTTER = [
    box_room(),
    shapes.icosphere(0.5, 3),
    shapes.cylinder(0.3, 0.8, 32).moved(1, -1, 1),
    shapes.box((0.5, 0.7, 0.4)).moved(-1, 0, 1),
]
SCENES = {
    "room": scene_of([box_room()]),
    "clutter": scene_of(CLUTTER, [Material("wall"), BOTH]),
    "many small": scene_of([box_room(), *[shapes.cylinder(0.02, 0.05, 12).moved(0, 0.1 * k, 0) for k in range(40)]]),
}


def _covered(scene: Scene, charts: Charts) -> int:
    return int((texel_surfaces(scene, charts, uniform_leaves(charts)).face >= 0).sum())


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("texels", [None, 5000, 40_000, 300_000])
def test_the_number_of_texels_is_met(name: str, texels: int | None) -> None:
    charts = parametrize(SCENES[name], texels=texels)
    aim = texels or max(32_000, 8 * len(charts.face_triangle))
    # whole patches: sides of rectangles come in steps of 4 texels, here about 4 in 29 or more
    assert abs(_covered(SCENES[name], charts) / aim - 1) < 0.15


def test_few_texels_give_the_minimum() -> None:
    charts = parametrize(SCENES["room"], texels=1)
    assert _covered(SCENES["room"], charts) == charts.chart_count == 6


def test_small_charts_leave_half_of_the_texels_to_large_ones() -> None:
    boxes = [shapes.box((0.1, 0.1, 0.1)).moved(k % 10 - 4.5, 0.3, k // 10 - 4.5) for k in range(100)]
    scene = scene_of([*boxes, shapes.box((12.0, 0.1, 12.0)).moved(0, -1, 0)])
    charts = parametrize(scene, texels=500)
    real = np.bincount(charts.face_chart, face_areas(scene, charts))
    floor = charts.chart_rects[real.argmax(), 2:].prod()
    assert charts.chart_count == 501 and floor == pytest.approx(250 * real.max() / real.sum(), rel=0.1)
    assert _covered(scene, charts) == 500 + floor


@pytest.mark.parametrize("scale", [0.5, 2.0, 4.0])
@pytest.mark.parametrize("density", [20.0, None])
def test_a_material_has_texels_by_its_lightmap_scale(scale: float, density: float | None) -> None:
    """As many as its scale squared says, and others those that they have without it."""
    meshes = [shapes.quad((k * 3.0, 0, 0), (2.4, 0, 0), (0, 2.4, 0)) for k in range(2)]
    meshes += [shapes.cylinder(1.2, 2.4, 64).moved(6 + k * 4, 0, 0) for k in range(2)]
    counts = []
    for times in (1.0, scale):
        materials = [Material(f"{k}", double_sided=k < 2, lightmap_scale=times if k % 2 else 1.0) for k in range(4)]
        scene = scene_of(meshes, materials)
        charts = parametrize(scene, density=density)
        face = texel_surfaces(scene, charts, uniform_leaves(charts)).face
        counts.append(np.bincount(scene.material_ids[charts.face_triangle[face[face >= 0]]], minlength=4))
    before, after = counts
    assert after[::2] == pytest.approx(before[::2], rel=0.02)  # charts begin elsewhere in the grid
    # sides of rectangles are rounded to 4 texels, of 24 at least; outlines of others meet texels that they cover in part
    assert after[1::2] / before[1::2] == pytest.approx(scale**2, rel=0.18)


@pytest.mark.parametrize("density", [5.0, 23.0])
def test_density_is_texels_per_metre(density: float) -> None:
    scene = scene_of(CLUTTER)
    charts = parametrize(scene, density=density)
    assert charts.density == density
    d1, d2 = charts.face_uv[:, 1] - charts.face_uv[:, 0], charts.face_uv[:, 2] - charts.face_uv[:, 0]
    area = np.abs(d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]) / 2
    curved = charts.face_chart > 17  # 6 walls, 6 sides of the box and, flat but round, not the cylinder's ends
    total = np.bincount(charts.face_chart, area)
    real = np.bincount(charts.face_chart, face_areas(scene, charts))
    whole = charts.chart_rects[:, 2] * charts.chart_rects[:, 3]
    rectangle = np.isclose(total, whole, rtol=1e-9)
    assert rectangle.sum() == 12 and curved.any()
    # unfolded charts are to scale (their warnings aside); rectangles round each side to 2 of at least 6 texels
    assert np.allclose(total[~rectangle], real[~rectangle] * density**2, rtol=1e-9)
    for rect, metres in zip(charts.chart_rects[rectangle], real[rectangle], strict=True):
        w, h = rect[2:]
        assert w >= h and all(n % ALIGN == 0 or n < 6 for n in (w, h))
        assert abs(np.log(w * h / (metres * density**2))) < np.log(8 / 6) * 2 + np.log(1.5)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"density": 0.0}, "--density 0: must be"),
        ({"density": float("nan")}, "--density nan: must be"),
        ({"texels": 0}, "--texels 0: must be 1 to 16777216"),
        ({"texels": MAX_TEXELS + 1}, "--texels 16777217: must be"),
        ({"density": 1.0, "texels": 5}, "only one of the two"),
        (
            {"density": 1e6},
            r"--density 1e\+06 needs 94,\d*,\d*,\d*,\d* texels: the limit is 16,777,216 \(density 42\d\)",
        ),
    ],
)
def test_what_cannot_be_had(asked: dict[str, float], message: str) -> None:
    with pytest.raises(UserError, match=message):
        parametrize(SCENES["room"], **asked)


def test_a_strip_longer_than_the_atlas() -> None:
    strip = scene_of([shapes.quad((0, 0, 0), (1e5, 0, 0), (0, 1, 0)), shapes.quad((0, 0, 1), (0, 1, 0), (1, 0, 0))])
    assert max(parametrize(strip).size) <= 16384  # less dense than 32 000 texels would be
    with pytest.raises(UserError, match="the limit is 16384 a side"):
        parametrize(strip, density=1.0)


@pytest.mark.parametrize("name", SCENES)
def test_charts_keep_apart_and_are_whole(name: str) -> None:
    scene = SCENES[name]
    charts = parametrize(scene, texels=20_000)
    assert charts.size[0] % charts.tile == charts.size[1] % charts.tile == 0
    assert (charts.chart_rects[:, :2] % ALIGN == 0).all()
    assert sorted(np.unique(charts.face_chart)) == list(range(charts.chart_count))
    assert sorted(np.unique(charts.face_facet)) == list(range(charts.facet_count))
    low, high = charts.chart_rects[:, :2], charts.chart_rects[:, :2] + charts.chart_rects[:, 2:]
    assert (charts.face_uv >= low[charts.face_chart][:, None]).all()
    assert (charts.face_uv <= high[charts.face_chart][:, None]).all()
    # texels as they are really covered: gap of 2 between charts
    leaves = uniform_leaves(charts)
    surfaces = texel_surfaces(scene, charts, leaves)
    owner = np.full((charts.size[1] + 4, charts.size[0] + 4), -1)
    tile, row, column = np.nonzero(surfaces.face >= 0)
    y, x = leaves.y[tile] * charts.tile + row + 2, leaves.x[tile] * charts.tile + column + 2
    owner[y, x] = charts.face_chart[surfaces.face[tile, row, column]]
    for dx in range(-2, 3):
        for dy in range(-2, 3):
            near = owner[y + dy, x + dx]
            assert ((near == -1) | (near == owner[y, x])).all()


def test_facets_are_flat_and_of_one_chart_and_side() -> None:
    scene = scene_of(CLUTTER, [Material("wall"), BOTH])
    charts = parametrize(scene)
    normal = scene.normals_areas[0][charts.face_triangle] * np.where(charts.face_back, -1, 1)[:, None]
    for facet in range(charts.facet_count):
        mine = charts.face_facet == facet
        assert len(np.unique(charts.face_chart[mine])) == len(np.unique(charts.face_back[mine])) == 1
        assert np.ptp(normal[mine], axis=0).max() < 1e-6  # exact shapes, float64
    flat = scene.object_ids[charts.face_triangle] == 3
    assert len(np.unique(charts.face_facet[flat])) == 6  # the box, which has no texels within


def test_back_sides_mirror_their_front() -> None:
    lamp = Material("lamp", double_sided=True)
    scene = scene_of([box_room(), shapes.icosphere(0.5, 2)], [Material("wall"), lamp])
    charts = parametrize(scene)
    dpdu, dpdv = faces_tangents(scene, charts)
    towards = np.cross(dpdu, dpdv)
    normal = scene.normals_areas[0][charts.face_triangle]
    assert ((np.einsum("fk,fk->f", towards, normal) < 0) == charts.face_back).all()
    front = {int(t): f for f, t in enumerate(charts.face_triangle) if not charts.face_back[f]}
    for f in np.flatnonzero(charts.face_back):
        g = front[int(charts.face_triangle[f])]
        a, b = charts.chart_rects[charts.face_chart[f]], charts.chart_rects[charts.face_chart[g]]
        assert (a[2:] == b[2:]).all() and charts.face_chart[f] != charts.face_chart[g]
        assert np.allclose(charts.face_uv[f, :, 0] - a[0], b[2] - (charts.face_uv[g, :, 0] - b[0]), atol=1e-9)
        assert np.allclose(charts.face_uv[f, :, 1] - a[1], charts.face_uv[g, :, 1] - b[1], atol=1e-9)


def test_the_layout_does_not_depend_on_how_polygons_are_cut() -> None:
    walls = [
        shapes.quad((0, 0, 0), (4, 0, 0), (0, 3, 0)),
        shapes.quad((0, 0, 0), (0, 0, 5), (4, 0, 0)),
        shapes.quad((0, 0, 0), (0, 3, 0), (0, 0, 5)),
    ]
    one = moved(scene_of(walls), TURN)
    many = moved(scene_of([split_grid(walls[0], 3, 2), split_grid(walls[1], 1, 4), walls[2]]), TURN)
    rng = np.random.default_rng(3)
    order = rng.permutation(len(many.triangles))
    many = Scene(
        **{
            **many.__dict__,
            "triangles": many.triangles[order],
            "material_ids": many.material_ids[order],
            "object_ids": many.object_ids[order],
            "uv0": None,
        }
    )
    texels = []
    for scene in (one, many):
        charts = parametrize(scene, texels=3000)
        surfaces = texel_surfaces(scene, charts, uniform_leaves(charts))
        covered = surfaces.face >= 0
        rows = np.concatenate([surfaces.position[covered], surfaces.area[covered][:, None]], axis=1)
        texels.append(rows[np.lexsort(np.round(rows, 6).T)])
    assert texels[0].shape == texels[1].shape
    # the weld, 1e-7 of a scene 7 across
    assert np.allclose(texels[0], texels[1], atol=1e-6)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_unit_does_not_matter(scale: float) -> None:
    scene = SCENES["clutter"]
    one = parametrize(scene, texels=20_000)
    other = parametrize(moved(scene, np.diag([scale, scale, scale, 1.0])), texels=20_000)
    assert one.size == other.size and (one.chart_rects == other.chart_rects).all()
    # xatlas works in float32 on both, from positions that differ in their last bit
    assert np.allclose(one.face_uv, other.face_uv, atol=0.02)
    assert np.isclose(one.density, other.density * scale, rtol=1e-5)


def test_progress_and_method() -> None:
    stages: list[str] = []
    charts = parametrize(SCENES["clutter"], progress=lambda stage, share: stages.append(stage))
    assert stages[0] == "joining corners" and stages[-1] == "joining edges of pieces"
    assert all(stage.split()[0].endswith("ing") for stage in stages), "each says what is being done"
    assert charts.method.startswith("12 rectangles, ") and charts.method.endswith(" xatlas charts")
    assert charts.dark_faces == 1420 and charts.warnings == ()  # within closed bodies


def test_surfaces_that_are_smaller_than_a_texel_are_said() -> None:
    """With a density that would do."""
    boxes = [0.3 * room()[:, ::-1] + (k % 10, 0.0, k // 10) for k in range(100)]
    scene = quads_scene([*room((10.0, 0.5, 10.0)), *np.concatenate(boxes)], [grey(0.5)])
    said = re.match(
        r"480 of 486 surfaces, .* smaller than a texel: --density (.*) would do",
        parametrize(scene, density=2.0).warnings[0],
    )
    assert said is not None
    assert parametrize(scene, density=float(said[1])).warnings == ()
