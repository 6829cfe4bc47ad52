"""The triangles as they are drawn: nothing is lost, what a view sees is there, from near to far, whatever lies in one plane."""

from __future__ import annotations

import numpy as np
import pytest
from atlas_scenes import TURN, moved, own_cache, scene_of, split_grid  # noqa: F401  # a fixture

import app.atlas.visible_mesh
from app.atlas.parametrize import parametrize
from app.atlas.sides import Edges
from app.atlas.t_junctions import _there_again
from app.atlas.visible_mesh import CLUSTER, VisibleMesh, visible_mesh
from app.lightmap.tile_pool import SolverSpace
from app.render.camera import CameraView
from app.scene import shapes
from app.scene.load import load_scene
from app.scene.model import F64, Material, Scene

SEEDS = range(6)
ASPECT = 1.5


def boxes(count: int, seed: int = 5) -> Scene:
    """On a lattice, so that faces of several often lie in one plane and overlap."""
    rng = np.random.default_rng(seed)
    places, sizes = rng.integers(0, 12, (count, 3)), rng.integers(1, 4, (count, 3))
    meshes = [shapes.box(size.astype(float)).moved(*place.tolist()) for place, size in zip(places, sizes, strict=True)]
    return scene_of(meshes, [Material(f"{k}", double_sided=k % 2 == 0) for k in range(7)])


def drawn_of(scene: Scene, monkeypatch: pytest.MonkeyPatch, cluster: int = 16) -> tuple[VisibleMesh, F64, SolverSpace]:
    """In small clusters, and the corners of its triangles (n, 3, 3), in the scene's order and solver space."""
    monkeypatch.setattr(app.atlas.visible_mesh, "CLUSTERED", 0)
    monkeypatch.setattr(app.atlas.visible_mesh, "CLUSTER", cluster)
    space = SolverSpace.of(scene)
    local = space.local_from_world(scene.positions)
    return visible_mesh(scene, parametrize(scene, texels=4000), local), local[scene.triangles], space


def random_view(space: SolverSpace, seed: int) -> F64:
    """clip_from_local of an eye inside the scene or outside, that looks at some place in it."""
    rng = np.random.default_rng(seed)
    view = CameraView(np.eye(4), float(rng.uniform(0.3, 0.9)), 1.0)
    view.focus(space.world_from_local(rng.uniform(-0.4, 0.4, 3)), space.scale * (0.05 if seed % 2 else 0.4))
    view.orbit(*rng.uniform(-3, 3, 2))
    return view.clip_from_local(ASPECT, space)


def test_every_triangle_is_there_once_with_its_corners(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = boxes(60)
    charts = parametrize(scene, texels=4000)
    drawn, points, _ = drawn_of(scene, monkeypatch)
    assert sorted(drawn.triangle.tolist()) == list(range(len(scene.triangles)))
    corners = drawn.vertices[drawn.corners]
    # half a unit of single precision in a scene of radius 1
    assert np.abs(corners["in_position"] - points[drawn.triangle]).max() < 2**-24
    assert (corners["in_material"] == scene.material_ids[drawn.triangle][:, None]).all()
    for back, name in enumerate(("in_uv_front", "in_uv_back")):
        expected = np.full((len(scene.triangles), 3, 2), -1.0, np.float32)
        mine = charts.face_back == bool(back)
        expected[charts.face_triangle[mine]] = charts.face_uv[mine]
        assert (corners[name] == expected[drawn.triangle]).all()


def test_corners_are_shared() -> None:
    """A sphere in one chart has half as many corners as triangles, and some more at its seams."""
    scene = scene_of([shapes.icosphere(1.0, 4)])
    drawn = visible_mesh(scene, parametrize(scene, texels=4000), scene.positions)
    assert len(drawn.vertices) < 0.75 * len(scene.triangles)


@pytest.mark.parametrize("seed", SEEDS)
def test_what_is_on_screen_is_seen(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    """A point on screen is one between the four sides and before the eye, however near or far."""
    drawn, points, space = drawn_of(boxes(150), monkeypatch)
    clip_from_local = random_view(space, seed)
    assert drawn.clusters is not None
    seen = drawn.clusters.triangles(drawn.clusters.seen(clip_from_local))
    shares = np.random.default_rng(seed).dirichlet(np.ones(3), 30)
    inside = np.einsum("sc,nci->nsi", shares, points)
    x, y, _, w = np.moveaxis(inside @ clip_from_local[:, :3].T + clip_from_local[:, 3], -1, 0)
    visible = ((np.abs(x) < w) & (np.abs(y) < w)).any(1)
    assert np.isin(np.flatnonzero(visible), drawn.triangle[seen]).all()
    assert visible.any()
    assert len(np.unique(seen)) == len(seen) < len(points), "something is left out"


def test_what_is_nearer_than_the_near_plane_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is drawn at the near plane: a floor right under the eye."""
    floor = split_grid(shapes.quad((-8, 0, -8), (0, 0, 16), (16, 0, 0)), 16, 16)
    drawn, points, space = drawn_of(scene_of([floor]), monkeypatch)
    view = CameraView(np.eye(4), 1.0, space.scale)
    view.orbit(0.0, np.pi / 2)
    view.world_from_camera[:3, 3] = (0.3, 0.005 * space.scale, 0.3)
    clip_from_local = view.clip_from_local(ASPECT, space)
    under = int(np.linalg.norm(points.mean(1) - space.local_from_world(view.eye), axis=1).argmin())
    z, w = clip_from_local[2:, :3] @ points[under].mean(0) + clip_from_local[2:, 3]
    assert 0 < w < -z, "before the eye, nearer than the near plane"
    assert drawn.clusters is not None
    assert under in drawn.triangle[drawn.clusters.triangles(drawn.clusters.seen(clip_from_local))]


@pytest.mark.parametrize("seed", SEEDS)
def test_from_near_to_far(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    drawn, points, space = drawn_of(boxes(150), monkeypatch)
    clip_from_local = random_view(space, seed)
    clusters = drawn.clusters
    assert clusters is not None
    order = clusters.seen(clip_from_local)
    free = order[order >= clusters.fixed]
    assert (order[: len(order) - len(free)] == np.sort(order[order < clusters.fixed])).all(), (
        "the fixed ones come first"
    )
    eye = np.linalg.inv(clip_from_local) @ [0.0, 0.0, -1.0, 0.0]  # where x, y and w vanish
    runs = [points[drawn.triangle[clusters.triangles(np.array([k]))]].reshape(-1, 3) for k in free]
    away = [np.linalg.norm((run.min(0) + run.max(0)) / 2 - eye[:3] / eye[3]) for run in runs]
    assert (np.diff(away) >= -1e-9).all()  # rounding of the eye, found in two ways
    assert len(free) > 3


@pytest.mark.parametrize("turned", [False, True])
def test_overlapping_faces_in_one_plane_keep_their_order(monkeypatch: pytest.MonkeyPatch, turned: bool) -> None:
    """Brute force: two triangles of one plane whose insides have common points come first, in the scene's order."""
    scene = boxes(60)
    drawn, points, _ = drawn_of(moved(scene, TURN) if turned else scene, monkeypatch)
    clusters = drawn.clusters
    assert clusters is not None
    fixed = drawn.triangle[: clusters.first[clusters.fixed]]
    assert (np.diff(fixed) > 0).all()
    a, along = points[:, 0], np.stack([points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]], -1)
    normal = np.cross(along[..., 0], along[..., 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    shares, common = np.random.default_rng(0).dirichlet(np.ones(3), 60), set()
    to_uv = np.linalg.pinv(along)
    for k in range(len(points)):
        inside = shares @ points[k] - a[:, None]  # (n, 60, 3), seen from each triangle
        uv = inside @ to_uv.swapaxes(1, 2)
        flat = (np.abs(inside @ normal[:, :, None]) < 1e-9).all((1, 2))
        overlaps = flat & ((uv > 1e-3).all(2) & (uv.sum(2) < 1 - 1e-3)).any(1)
        overlaps[k] = False
        common |= {k, *np.flatnonzero(overlaps).tolist()} if overlaps.any() else set()
    assert len(common) > 100
    assert common <= set(fixed.tolist())
    assert len(fixed) < 1.1 * len(common), "few besides, whose common part no sample hit"


@pytest.mark.parametrize("turned", [False, True])
def test_what_only_touches_is_free(monkeypatch: pytest.MonkeyPatch, turned: bool) -> None:
    """The quads of one flat floor."""
    floor = split_grid(shapes.quad((0, 0, 0), (0, 0, 16), (16, 0, 0)), 16, 16)
    scene = scene_of([floor])
    drawn, _, _ = drawn_of(moved(scene, TURN) if turned else scene, monkeypatch)
    assert drawn.clusters is not None
    assert drawn.clusters.fixed == 0


def test_very_many_faces_in_one_plane_are_all_fixed(monkeypatch: pytest.MonkeyPatch) -> None:
    """More than can be compared with each other."""
    monkeypatch.setattr(app.atlas.visible_mesh, "COMPARED", 4)
    quads = [shapes.quad((0.01 * k, 0, 0), (0, 0, 1), (1, 0, 0)) for k in range(100)]
    drawn, _, _ = drawn_of(scene_of(quads), monkeypatch)
    clusters = drawn.clusters
    assert clusters is not None
    assert clusters.fixed == len(clusters.lower)
    assert (drawn.triangle == np.arange(200)).all()


def test_small_scenes_have_no_clusters() -> None:
    for name in ("cornell-box", "two-rooms"):
        scene = load_scene(name)
        drawn = visible_mesh(scene, parametrize(scene, texels=4000), scene.positions)
        assert drawn.clusters is None
        assert (np.diff(drawn.triangle) >= 0).all() and (
            np.unique(drawn.triangle) == np.arange(len(scene.triangles))
        ).all()


@pytest.mark.parametrize("clustered", [False, True])
def test_triangles_are_divided_where_corners_lie_on_their_edges(
    monkeypatch: pytest.MonkeyPatch, clustered: bool
) -> None:
    """A floor of one quad beside one of 5 × 3: 4 corners on the common edge. Its parts make it whole, wherever corners lie in the
    atlas."""
    if clustered:
        monkeypatch.setattr(app.atlas.visible_mesh, "CLUSTERED", 0)
    whole, strips = (
        shapes.quad((0, 0, 0), (0, 0, 1), (1, 0, 0)),
        split_grid(shapes.quad((0, 0, 0), (-1, 0, 0), (0, 0, 1)), 3, 5),
    )
    scene = moved(scene_of([whole, strips], [Material("floor", double_sided=True)]), TURN)
    drawn = visible_mesh(
        scene, parametrize(scene, texels=4000), SolverSpace.of(scene).local_from_world(scene.positions)
    )
    corners = drawn.vertices[drawn.corners]
    rows, which = drawn.rows_of(np.array([1, 0, 7]))
    assert (
        np.bincount(which).tolist() in ([5, 1, 1], [1, 5, 1])
        and (drawn.triangle[rows] == np.array([1, 0, 7])[which]).all()
    )
    assert len(drawn.corners) == len(scene.triangles) + 4
    for name in ("in_position", "in_uv_front", "in_uv_back"):
        edges = (corners[name][:, 1:] - corners[name][:, :1]).astype(np.float64)
        area = np.sqrt(np.linalg.det(edges @ edges.swapaxes(1, 2)))
        of_triangles = np.bincount(drawn.triangle, area)
        assert of_triangles[:2] == pytest.approx(area.sum() / 4, rel=1e-5)
    edge = np.sort(drawn.corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2))
    assert (np.unique(edge, axis=0, return_counts=True)[1] <= 2).all()
    assert drawn.at_corners(rows, scene.positions[scene.triangles]) == pytest.approx(
        SolverSpace.of(scene).world_from_local(corners["in_position"][rows].astype(np.float64)), abs=1e-6
    )


def test_clusters_are_small(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn, points, _ = drawn_of(scene_of([shapes.icosphere(1.0, 4)]), monkeypatch, cluster=CLUSTER)
    clusters = drawn.clusters
    assert clusters is not None
    count = np.diff(clusters.first)
    assert (count[:-1] == CLUSTER).all() and count.sum() == len(points)
    extent = np.prod(clusters.upper - clusters.lower, axis=1)
    assert np.median(extent) < 0.05 * np.prod(np.ptp(points.reshape(-1, 3), axis=0))


def test_a_sheet_that_is_there_again_is_one() -> None:
    quad = np.array([[0, 1, 2], [0, 2, 3]])
    for there, again in (
        (quad, 0),
        (np.concatenate([quad, quad[:, ::-1]]), 2),
        (np.concatenate([quad, quad[:1]] * 2), 4),
    ):
        assert len(_there_again(there, Edges.of(there.astype(np.int32)))) == again
