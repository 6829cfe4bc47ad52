"""A bake as a reference: read back, matched with a scene by its triangles, and asked for its light."""

from __future__ import annotations

import dataclasses
import errno
import os
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from solver_scenes import quads_scene, room

from app.atlas.charts import Charts
from app.atlas.options import AtlasOptions
from app.atlas.parametrize import parametrize
from app.atlas.points import Points, barycentric, bilinear
from app.bake import write_bake
from app.bake.options import BakeOptions
from app.bake.read import read_bake
from app.compare.reference_light import ReferenceLight, light_of_bake
from app.compare.reference_task import ReferenceTask
from app.errors import UserError
from app.lightmap.tile_pool import TilePool
from app.reference.metrics import point_errors
from app.scene.model import F32, Camera, Material, Scene
from app.session import comparison_solve
from app.session.comparison_solve import solved_light
from app.util import cache
from app.util.background import Progress

MATERIALS = (
    Material("plaster", (0.7, 0.6, 0.5)),
    Material("lamp", (0.1, 0.1, 0.1), (20.0, 10.0, 5.0), double_sided=True),
)
SHEET = np.array([[0.2, 0.5, 0.3], [0.8, 0.5, 0.3], [0.8, 0.5, 0.7], [0.2, 0.5, 0.7]])


def sheet_in_a_room(centre: tuple[float, float, float] = (0, 0, 0)) -> Scene:
    """Lit on both sides."""
    return quads_scene(np.concatenate([room(), SHEET[None]]) + centre, MATERIALS, [0] * 6 + [1])


def camera_at(place: float) -> Camera:
    """On the room's diagonal, whose ends are at 0 and 1."""
    world_from_camera = np.eye(4)
    world_from_camera[:3, 3] = place
    return Camera("eye", world_from_camera, 1.0)


def charts_of(scene: Scene) -> Charts:
    return parametrize(scene, texels=900)


def written(folder: Path, scene: Scene, report: dict[str, object] | None = None) -> F32:
    """A bake of random light; its image."""
    charts = charts_of(scene)
    image = np.random.default_rng(5).uniform(1, 2, (*charts.size[::-1], 3)).astype(np.float32)
    write_bake(folder, scene, charts, image, np.ones(image.shape[:2], bool), report or {}, BakeOptions(exr_float=True))
    return image


@pytest.mark.parametrize("centre", [(0, 0, 0), (1e5, -3e4, 7e5)], ids=["here", "far"])
@pytest.mark.parametrize("turn", [0, 1, 2])
def test_a_bake_gives_its_light_back_on_every_side(
    tmp_path: Path, centre: tuple[float, float, float], turn: int
) -> None:
    scene = sheet_in_a_room(centre)
    image = written(tmp_path, scene, {"texels": 512, "residual": 1e-3})
    charts = charts_of(scene)
    assert charts.face_back.sum() == 2
    bake = read_bake(tmp_path)
    assert bake.scene.uv1 is not None
    turned = dataclasses.replace(  # as other programs may write them: beginning with another corner
        bake.scene, triangles=np.roll(bake.scene.triangles, turn, axis=1), uv1=np.roll(bake.scene.uv1, turn, axis=1)
    )
    light = light_of_bake(dataclasses.replace(bake, scene=turned), scene)
    random = np.random.default_rng(6)
    face = random.integers(len(charts.face_triangle), size=200)
    weights = random.dirichlet((1, 1, 1), 200)
    points = Points(charts.face_triangle[face], charts.face_back[face], weights)
    expected = bilinear(image, np.einsum("nk,nkc->nc", weights, charts.face_uv[face]))
    # texture coordinates are 32-bit floats: 1e-7 of the atlas's texels, of which light changes by 1 each
    np.testing.assert_allclose(light.at(points), expected, atol=2e-7 * max(charts.size))
    assert (light.texels, light.unshot) == (512, 1e-3)
    assert light.other_materials(scene.materials) == []


def test_any_file_of_a_bake_stands_for_it(tmp_path: Path) -> None:
    image = written(tmp_path, sheet_in_a_room())
    np.testing.assert_array_equal(read_bake(tmp_path / "irradiance.exr").irradiance, image)
    assert read_bake(tmp_path / "report.json").report["pages"] == 1


def test_a_finer_solve_is_kept_for_the_sides_that_have_texels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They depend on whether a camera is within a closed body of two-sided material; other cameras may be anywhere."""
    calls = []

    def solve(source: Path, target: Path, tell: Progress) -> None:
        calls.append(source)
        answer = {"triangle": np.zeros(1), "back": np.zeros(1), "uv": np.zeros((1, 3, 2)), "texels": np.array(4)}
        cache.write(target, {"image": np.zeros((2, 2, 3)), "unshot": np.array(0.0), **answer})

    monkeypatch.setattr(comparison_solve, "_run_worker", solve)
    with cache.elsewhere(tmp_path):
        for place, solves in ((5.0, 1), (6.0, 1), (0.5, 2)):
            scene = dataclasses.replace(sheet_in_a_room(), cameras=(camera_at(place),))
            solved_light(scene, AtlasOptions(), 0.01, lambda stage, share: None)
            assert len(calls) == solves


def test_other_materials_are_named(tmp_path: Path) -> None:
    scene = sheet_in_a_room()
    written(tmp_path, scene)
    plaster, lamp = scene.materials
    edited = (dataclasses.replace(plaster, albedo=(0.7, 0.6, 0.51)), dataclasses.replace(lamp, emission=(20, 10, 6)))
    light = light_of_bake(read_bake(tmp_path), scene.with_materials(edited))
    assert light.other_materials(edited) == ["plaster", "lamp"]
    assert light.other_materials(scene.materials) == []


def test_a_bake_of_another_scene_is_refused(tmp_path: Path) -> None:
    scene = sheet_in_a_room()
    written(tmp_path, scene)
    bake = read_bake(tmp_path)
    moved = scene.positions.copy()
    moved[0] += 0.01
    with pytest.raises(UserError, match=r"is of another scene: \d+\.\d% of the surfaces of quads are not in it"):
        light_of_bake(bake, dataclasses.replace(scene, positions=moved))
    with pytest.raises(UserError, match="it has surfaces that quads has not"):
        light_of_bake(bake, quads_scene(room(), MATERIALS, [0] * 6))
    written(tmp_path, quads_scene(room(), MATERIALS, [0] * 6))
    with pytest.raises(UserError, match="are not in it"):
        light_of_bake(read_bake(tmp_path), scene)


def test_a_bake_may_have_insides_that_the_scene_leaves_out(tmp_path: Path) -> None:
    """That of a box of two-sided material: while a camera was in it, its inside had texels. Not other surfaces beside them."""
    quads = np.concatenate([room(), 0.3 + 0.4 * room()])
    scene = quads_scene(quads, MATERIALS, [0] * 6 + [1] * 6)
    watched = dataclasses.replace(scene, cameras=(camera_at(0.5),))
    image = written(tmp_path, watched)
    assert len(charts_of(watched).face_back) == len(charts_of(scene).face_back) + 12
    light = light_of_bake(read_bake(tmp_path), scene)
    assert light.image.shape == image.shape and len(light.triangle) == 24
    with pytest.raises(UserError, match="it has surfaces that quads has not"):
        light_of_bake(read_bake(tmp_path), quads_scene(room(), MATERIALS, [0] * 6))


def test_what_cannot_be_read_is_said(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"is no bake, irradiance.exr and scene.glb missing"):
        read_bake(tmp_path)
    written(tmp_path, sheet_in_a_room())
    exr = tmp_path / "irradiance.exr"
    exr.write_bytes(b"not an image")
    with pytest.raises(UserError, match="cannot be read as OpenEXR"):
        read_bake(tmp_path)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"Y": np.ones((4, 4), np.float32)}).write(str(exr))
    with pytest.raises(UserError, match="has channels Y: R, G, B are needed"):
        read_bake(tmp_path)
    OpenEXR.File(header, {"RGB": np.full((4, 4, 3), np.nan, np.float32)}).write(str(exr))
    with pytest.raises(UserError, match="not finite"):
        read_bake(tmp_path)


def test_a_full_disk_is_said() -> None:
    def work(tell: Progress) -> ReferenceLight:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "/somewhere")

    scene = sheet_in_a_room()
    task = ReferenceTask(TilePool(scene, charts_of(scene)), work)
    with pytest.raises(UserError, match="the reference: No space left on device"):
        assert task.result


def test_barycentric_weights_make_the_point() -> None:
    random = np.random.default_rng(8)
    corners = random.normal(size=(50, 3, 3))
    weights = random.dirichlet((1, 1, 1), 50) * 2 - 1 / 3  # some outside
    position = np.einsum("nk,nkc->nc", weights, corners)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(barycentric(position, corners), weights, atol=1e-10)
    np.testing.assert_allclose(barycentric(position + normal, corners), weights, atol=1e-9)


def test_errors_of_light_that_is_broken_are_no_numbers() -> None:
    reference = np.ones((4, 3))
    error = point_errors(reference * [[1.1], [1.1], [1.1], [1.3]], reference)
    assert error.rms == pytest.approx(np.sqrt((3 * 0.01 + 0.09) / 4))
    assert (error.bias, error.median, error.q90) == pytest.approx((0.15, 0.1, 0.3))
    assert np.isnan(point_errors(np.full((4, 3), np.inf), reference)).all()
    assert np.isnan(point_errors(reference[:0], reference[:0])).all()
