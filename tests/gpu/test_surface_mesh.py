"""Pictures of many triangles, of which a view draws only those that it may see, in another order: they show the same."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray
from pictures import framing
from solver_scenes import grey, quads_scene

import app.atlas.visible_mesh
from app.atlas.parametrize import parametrize
from app.atlas.visible_mesh import Clusters
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.render.camera import CameraView
from app.render.frame import FrameRenderer
from app.render.options import DisplayOptions
from app.scene import shapes
from app.scene.model import F64, Material, Scene

SIZE = (160, 120)
ALBEDO = DisplayOptions(layer="albedo", interpolation="nearest", tone_map="clamp")

# Of a room 2 × 1 × 3: origin and two edges each
SIDES = [
    ((0, 0, 0), (0, 0, 3), (2, 0, 0)),
    ((0, 1, 0), (2, 0, 0), (0, 0, 3)),
    ((0, 0, 0), (2, 0, 0), (0, 1, 0)),
    ((2, 0, 0), (0, 0, 3), (0, 1, 0)),
    ((2, 0, 3), (-2, 0, 0), (0, 1, 0)),
    ((0, 0, 3), (0, 0, -3), (0, 1, 0)),
]


def boxes() -> Scene:
    """On a lattice, so that faces of several often lie in one plane and overlap; each in a grey of its own."""
    rng = np.random.default_rng(5)
    places, sizes = rng.integers(0, 12, (60, 3)), rng.integers(1, 4, (60, 3))
    mesh = shapes.merged([shapes.box(s.astype(float)).moved(*p.tolist()) for p, s in zip(places, sizes, strict=True)])
    number = np.repeat(np.arange(60), 12).astype(np.int32)
    greys = tuple(Material(f"{k}", albedo=(k / 60,) * 3, double_sided=True) for k in range(60))
    return Scene(
        "boxes", mesh.positions, mesh.triangles.astype(np.int32), number, number, tuple(map(str, range(60))), greys
    )


@pytest.fixture(scope="module")
def scene() -> Scene:
    return boxes()


@pytest.fixture
def lightmaps(gpu: Gpu, scene: Scene, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Lightmap, Lightmap]]:
    """The scene in clusters, and in its own order without."""
    charts = parametrize(scene, texels=4000)
    whole = Lightmap.of(gpu, scene, charts)
    assert whole.pool.visible_mesh.clusters is None
    monkeypatch.setattr(app.atlas.visible_mesh, "CLUSTERED", 0)
    monkeypatch.setattr(app.atlas.visible_mesh, "CLUSTER", 16)
    cut = Lightmap.of(gpu, scene, charts)
    assert cut.pool.visible_mesh.clusters is not None
    yield cut, whole
    gpu.release_all()
    cut.release()
    whole.release()


def views(scene: Scene) -> Iterator[CameraView]:
    """Eyes inside and outside, every fourth along an axis, where coplanar faces have one depth all over."""
    rng = np.random.default_rng(11)
    lower, upper = scene.bounds
    yield framing(lower, upper)
    for k in range(15):
        view = CameraView(np.eye(4), float(rng.uniform(0.4, 1.5)), 1.0)
        reach = float(np.linalg.norm(upper - lower)) * (0.05, 0.2, 0.8)[k % 3]
        view.focus(lower + rng.uniform(0.2, 0.8, 3) * (upper - lower), reach)
        view.orbit(*(rng.uniform(-3, 3, 2) if k % 4 else (np.pi / 2 * (k // 4), 0.0)))
        yield view


class Viewer:
    """Pictures of one lightmap after another, with what one was left with by the view before."""

    def __init__(self, gpu: Gpu) -> None:
        self.renderer, self._colour = FrameRenderer(gpu), gpu.texture(SIZE, 4, "f1")
        self._gpu, self._target = gpu, gpu.target(self._colour)

    def picture(self, lightmap: Lightmap, view: CameraView) -> NDArray[np.uint8]:
        self.renderer.render(self._target, SIZE, lightmap, view, ALBEDO)
        return np.frombuffer(self._colour.read(), np.uint8).reshape(SIZE[1], SIZE[0], 4)[::-1]

    def release(self) -> None:
        self.renderer.release()
        self._gpu.release_all(self._target)
        self._colour.release()


@pytest.fixture
def viewers(gpu: Gpu) -> Iterator[tuple[Viewer, Viewer]]:
    both = Viewer(gpu), Viewer(gpu)
    yield both
    for viewer in both:
        viewer.release()


def test_clusters_do_not_change_the_picture(
    scene: Scene, lightmaps: tuple[Lightmap, Lightmap], viewers: tuple[Viewer, Viewer], monkeypatch: pytest.MonkeyPatch
) -> None:
    left_out, greys, seen = [], set(), Clusters.seen

    def counted(self: Clusters, clip_from_local: F64) -> NDArray[np.int64]:
        order = seen(self, clip_from_local)
        left_out.append(len(self.lower) - len(order))
        return order

    monkeypatch.setattr(Clusters, "seen", counted)
    for view in views(scene):
        cut, whole = (viewer.picture(lightmap, view) for viewer, lightmap in zip(viewers, lightmaps, strict=True))
        greys |= set(whole[..., 0].ravel().tolist())
        assert (cut == whole).all()
    assert min(left_out) == 0 and max(left_out) > 10
    assert len(greys) > 30


def test_picks_are_the_same(
    scene: Scene, lightmaps: tuple[Lightmap, Lightmap], viewers: tuple[Viewer, Viewer], rng: np.random.Generator
) -> None:
    """And looking into one pixel does not spoil the next picture."""
    hits = 0
    for view in views(scene):
        before, _ = (viewer.picture(lightmap, view) for viewer, lightmap in zip(viewers, lightmaps, strict=True))
        for x, y in np.stack([rng.integers(0, n, 6) for n in SIZE], -1):
            cut, whole = (viewer.renderer.pick(x, y) for viewer in viewers)
            assert (cut is None) == (whole is None)
            if cut is not None and whole is not None:
                assert (cut.triangle, cut.back, cut.material, cut.facet) == (
                    whole.triangle,
                    whole.back,
                    whole.material,
                    whole.facet,
                )
                assert cut.position == pytest.approx(whole.position, abs=1e-9)
                hits += 1
        assert (viewers[0].picture(lightmaps[0], view) == before).all()
    assert hits > 30


def test_as_many_clusters_but_others(
    scene: Scene, lightmaps: tuple[Lightmap, Lightmap], viewers: tuple[Viewer, Viewer]
) -> None:
    """A half turn shows as much of the scene, from its middle."""
    lower, upper = scene.bounds
    clusters = lightmaps[0].pool.visible_mesh.clusters
    assert clusters is not None
    compared = 0
    for k in range(60):
        there = CameraView(np.eye(4), 0.8, 1.0)
        there.world_from_camera[:3, 3] = (lower + upper) / 2
        there.orbit(0.1 * k, 0.0)
        there.world_from_camera[:3, 3] = (lower + upper) / 2
        back = there.copy()
        back.world_from_camera[:3, :3] = back.world_from_camera[:3, :3] @ np.diag([-1.0, 1.0, -1.0])
        if (
            len({len(clusters.seen(v.clip_from_local(SIZE[0] / SIZE[1], lightmaps[0].space))) for v in (there, back)})
            == 1
        ):
            for view in (there, back):
                cut, whole = (
                    viewer.picture(lightmap, view) for viewer, lightmap in zip(viewers, lightmaps, strict=True)
                )
                assert (cut == whole).all()
            compared += 1
    assert compared > 2


def test_no_background_is_seen_through_a_closed_room(gpu: Gpu, viewers: tuple[Viewer, Viewer]) -> None:
    """Whose walls have other corners along their edges than its floor has."""
    quads = []
    for nth, (origin, u, v) in enumerate(np.array(SIDES, np.float64)):
        across, up = (1, 1) if nth == 0 else (4 + nth, 2)
        cells = [(origin + u * i / across + v * k / up, u / across, v / up) for i in range(across) for k in range(up)]
        quads += [(at, at + a, at + a + b, at + b) for at, a, b in cells]
    scene = quads_scene(quads, [grey(1.0, double_sided=True)], [0] * len(quads))
    lightmap = Lightmap.of(gpu, scene, parametrize(scene, texels=4000))
    holes = 0
    for k in range(24):
        view = CameraView(np.eye(4), 1.6, 1.0)
        view.world_from_camera[:3, 3] = (1.1, 0.6, 1.4)
        view.orbit(0.27 * k, 0.2 * (k % 3 - 1))
        view.world_from_camera[:3, 3] = (1.1, 0.6, 1.4)
        holes += int((viewers[0].picture(lightmap, view)[..., :3] < 250).any(-1).sum())
    lightmap.release()
    assert holes == 0


def test_a_view_of_nothing(lightmaps: tuple[Lightmap, Lightmap], viewers: tuple[Viewer, Viewer], scene: Scene) -> None:
    """All clusters are left out: background, and then the scene again."""
    lower, upper = scene.bounds
    view = framing(lower, upper)
    there = viewers[0].picture(lightmaps[0], view)
    away = view.copy()
    away.world_from_camera[:3, :3] = away.world_from_camera[:3, :3] @ np.diag([-1.0, 1.0, -1.0])
    nothing = [viewer.picture(lightmap, away) for viewer, lightmap in zip(viewers, lightmaps, strict=True)]
    assert (nothing[0] == nothing[1]).all()
    assert viewers[0].renderer.pick(80, 60) is None
    assert (viewers[0].picture(lightmaps[0], view) == there).all()
    assert (there != nothing[0]).any()
