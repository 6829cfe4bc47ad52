"""The visible mesh on disk is the one that would be made, and another one where scene or charts are others."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from atlas_scenes import box_room, scene_of

from app.atlas import mesh_cache, visible_mesh
from app.atlas.mesh_cache import kept_mesh
from app.atlas.parametrize import parametrize
from app.atlas.visible_mesh import VisibleMesh
from app.scene import shapes
from app.util import cache


@pytest.mark.parametrize("clustered", [True, False], ids=["clusters", "few"])
def test_what_is_kept_is_the_same_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, clustered: bool) -> None:
    monkeypatch.setattr(mesh_cache, "FEWEST", 0)
    monkeypatch.setattr(visible_mesh, "CLUSTERED", 0 if clustered else 1 << 20)
    shelf = shapes.quad((-1.0, 0.0, 0.3), (1.7, 0, 0), (0, 1, 0))
    half = shapes.quad((-1.0, 1.0, 0.3), (0.85, 0, 0), (0, 0.3, 0))  # a corner lies on the shelf's edge: a T-junction
    scene = scene_of([box_room(), shapes.cylinder(0.41, 1.07, 14).moved(1, 0, 1), shelf, half])
    charts = parametrize(scene, texels=2000)
    with cache.elsewhere(tmp_path):
        first = kept_mesh(scene, charts, scene.positions)
        assert (first.clusters is not None) == clustered
        [kept] = (tmp_path / "mesh").glob("*.npz")
        with np.load(kept) as data:
            whole = np.bincount(first.triangle)[first.triangle] == 1  # those that are not divided have no weights
            np.testing.assert_array_equal(data["parts"], np.flatnonzero(~whole))
            assert whole.any() and len(data["weights"]) == np.count_nonzero(~whole) > 0
        monkeypatch.setattr(mesh_cache, "visible_mesh", lambda *_: first_again)
        first_again = dataclasses.replace(first, triangle=first.triangle[::-1])
        assert same(kept_mesh(scene, charts, scene.positions), first)
        assert kept_mesh(scene, charts, scene.positions + 1) is first_again
        moved = dataclasses.replace(charts, face_uv=charts.face_uv + 1)
        assert kept_mesh(scene, moved, scene.positions) is first_again
        for file in (tmp_path / "mesh").glob("*.npz"):
            file.write_bytes(file.read_bytes()[:100])
        assert kept_mesh(scene, charts, scene.positions) is first_again


def same(one: VisibleMesh, other: VisibleMesh) -> bool:
    parts = [(vars(mesh) | {"clusters": None}, vars(mesh.clusters) if mesh.clusters else {}) for mesh in (one, other)]
    return all(
        a.keys() == b.keys() and all(type(a[k]) is type(b[k]) and np.array_equal(a[k], b[k]) for k in a)
        for a, b in zip(*parts, strict=True)
    )
