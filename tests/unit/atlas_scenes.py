"""Small scenes for the atlas tests, and what every atlas must satisfy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from app.atlas.charts import Charts
from app.scene import shapes
from app.scene.model import F64, Material, Scene
from app.scene.shapes import Mesh

TURN = shapes.transform((0.3, -0.7, 1.1), (31.0, 47.0, 13.0), 1.0)  # no edge stays along an axis


def scene_of(meshes: Sequence[Mesh], materials: Sequence[Material] = (Material("grey"),)) -> Scene:
    """One object per mesh; materials in turn, the last one for the rest."""
    mesh = shapes.merged(meshes)
    number = np.repeat(np.arange(len(meshes)), [len(m.triangles) for m in meshes]).astype(np.int32)
    return Scene(
        name="test",
        positions=mesh.positions,
        triangles=mesh.triangles.astype(np.int32),
        material_ids=np.minimum(number, len(materials) - 1).astype(np.int32),
        object_ids=number,
        objects=tuple(f"object {k}" for k in range(len(meshes))),
        materials=tuple(materials),
        uv0=mesh.uv[mesh.triangles].astype(np.float32),
    )


def box_room(size: tuple[float, float, float] = (4.0, 3.0, 5.0)) -> Mesh:
    """A box that faces inwards."""
    return shapes.box(size).flipped()


def moved(scene: Scene, matrix: F64) -> Scene:
    """The scene under a (4, 4) similarity."""
    import dataclasses

    return dataclasses.replace(scene, positions=scene.positions @ matrix[:3, :3].T + matrix[:3, 3])


def split_grid(mesh: Mesh, across: int, up: int, *, flip_diagonal: bool = False) -> Mesh:
    """A quad cut into across × up quads."""
    origin, u, _, v = mesh.positions
    u, v = u - origin, v - origin
    quads = [
        shapes.quad(origin + u * i / across + v * j / up, u / across, v / up) for i in range(across) for j in range(up)
    ]
    if flip_diagonal:
        quads = [Mesh(q.positions, np.array([[1, 2, 3], [1, 3, 0]]), q.uv) for q in quads]
    return shapes.merged(quads)


def face_areas(scene: Scene, charts: Charts) -> F64:
    return scene.normals_areas[1][charts.face_triangle]


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """One cache of unwrapped meshes for the whole run, not the user's."""
    folder = tmp_path_factory.getbasetemp() / "cache"
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(folder))
