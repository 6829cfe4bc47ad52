"""The picture that errors are seen in: which points it shows, how they look, and what its FLIP says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.bench.accuracy import reference_picture as pictures
from app.gpu import Gpu
from app.lightmap.tile_pool import SolverSpace
from app.reference.irradiance import ReferenceIrradiance, no_tracer, reference_irradiance
from app.render.camera import CameraView
from app.render.exposure import KEY
from app.render.tone_mapping import encode_srgb
from app.scene.load import load_scene
from app.scene.model import Scene
from app.util.tables import FLIP, missing

needs_flip = pytest.mark.skipif(missing(FLIP) is not None, reason="of the extra bench")


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(tmp_path / "cache"))


def silent(text: str, share: float) -> None:
    pass


def seen_from(gpu: Gpu, scene: Scene) -> pictures.ReferencePicture:
    """By a closed form."""
    known = reference_irradiance(scene, "closed-form", 1, silent)
    found = pictures.reference_picture(gpu, scene, known, 1, silent)
    assert found is not None
    return found


@needs_flip
def test_a_furnace_is_one_colour(gpu: Gpu) -> None:
    found = seen_from(gpu, load_scene("furnace"))
    assert found.lit.all() and found.noise is None
    picture = found.by_light(found.E)
    # what is reflected is exposed to mid grey, and the walls emit as much again
    np.testing.assert_allclose(picture, encode_srgb(np.array(2 * KEY)), atol=1e-9)
    assert found.flip(found.E) == 0.0
    little, much = found.flip(1.02 * found.E), found.flip(1.1 * found.E)
    assert little is not None and much is not None and 0 < little < much < 1
    assert found.flip(np.nan * found.E) is None


def test_points_lie_behind_their_pixels(gpu: Gpu) -> None:
    """Row by row from the top, of the first camera."""
    scene, (width, height) = load_scene("textured-room"), pictures.SIZE
    shown, points = pictures._seen(gpu, scene)
    space, camera = SolverSpace.of(scene), scene.cameras[0]
    away = float(np.linalg.norm(np.asarray(camera.world_from_camera)[:3, 3] - space.centre))
    local = space.local_from_world(points.positions_normals(scene)[0])
    clip = np.pad(local, ((0, 0), (0, 1)), constant_values=1.0)
    clip = clip @ CameraView.from_camera(camera, away).clip_from_local(width / height, space).T
    x, y = (clip[:, :2] / clip[:, 3:]).T
    at = np.stack([(x + 1) / 2 * width, (1 - y) / 2 * height])
    # positions are 32-bit floats interpolated across triangles as long as the room: a hundredth of a pixel
    np.testing.assert_allclose(at, np.stack([shown % width, shown // width]) + 0.5, atol=0.01)
    # fronts face the camera
    position, normal = points.positions_normals(scene)
    towards = np.asarray(camera.world_from_camera)[:3, 3] - position
    assert (np.einsum("nk,nk->n", towards, normal) > 0).all()


def test_points_have_the_colours_of_their_textures(gpu: Gpu) -> None:
    scene = load_scene("textured-room")
    _, points = pictures._seen(gpu, scene)
    albedo = pictures._colours(scene, points, "albedo")
    checked = 0
    for k, material in enumerate(scene.materials):
        mine = scene.material_ids[points.triangle] == k
        if material.albedo_texture is None:
            assert (albedo[mine] == material.albedo).all()
        elif not material.albedo_texture.bilinear:
            palette = (material.albedo_texture.pixels * np.array(material.albedo)).reshape(-1, 3)
            off = np.abs(albedo[mine][:, None] - palette[None]).max(2).min(1)
            assert off.max() < 1e-6 and len(np.unique(albedo[mine].round(4), axis=0)) > 1
            checked += 1
    assert checked


def test_the_back_of_one_side_is_black(gpu: Gpu) -> None:
    scene = load_scene("furnace")
    points = pictures._seen(gpu, scene)[1]
    points.back[:] = True
    assert (
        not pictures._colours(scene, points, "albedo").any() and not pictures._colours(scene, points, "emission").any()
    )
    assert not pictures._reflecting(scene, points).any()


@needs_flip
def test_paths_make_the_picture_once(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    if (reason := no_tracer()) is not None:
        pytest.skip(reason)
    from app.reference import path_tracer as tracer

    scene = load_scene("furnace")
    known = reference_irradiance(scene, "closed-form", 1, silent)
    traced = ReferenceIrradiance("path-traced", known.points, known.E, None, "", 0.0)
    first = pictures.reference_picture(gpu, scene, traced, 200, silent)
    monkeypatch.setattr(tracer.Tracer, "irradiance", None)
    again = pictures.reference_picture(gpu, scene, traced, 200, silent)
    assert first is not None and again is not None and first.noise == again.noise
    np.testing.assert_array_equal(first.E, again.E)
    # 200 paths from 2000 points are 8 for a pixel, whose mean over 49,152 of them is within 1 %
    assert first.E.mean() == pytest.approx(2.0, rel=0.01)
    assert first.noise is not None and 0 < first.noise < 1


def test_there_is_no_picture_where_it_would_take_too_long(gpu: Gpu) -> None:
    scene = load_scene("furnace")
    known = reference_irradiance(scene, "closed-form", 1, silent)
    assert (
        pictures.reference_picture(
            gpu, scene, ReferenceIrradiance("dense", known.points, known.E, None, "", 0.0), 1, silent
        )
        is None
    )
