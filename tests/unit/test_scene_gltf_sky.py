"""The sky of a glTF scene: EXT_lights_image_based."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scene_files import png, quad_gltf, written

from app.errors import SceneError
from app.scene.images import linear_from_srgb
from app.scene.load import load_scene
from app.scene.model import Scene
from app.scene.sky import directions

COLOURS = np.array([(250, 0, 0), (0, 250, 0), (0, 0, 250), (250, 250, 0), (250, 0, 250), (0, 250, 250)], np.uint8)
TOWARDS = np.repeat(np.eye(3), 2, axis=0) * np.tile([[1.0], [-1.0]], (3, 1))  # +X, -X, +Y, …
QUARTER = [0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)]  # 90° about y, +x to -z


def with_sky(folder: Path, faces: list[bytes], **more: Any) -> Scene:
    gltf = quad_gltf()
    gltf.json["images"] = [{"bufferView": gltf.view(face), "mimeType": "image/png"} for face in faces]
    light = {"specularImages": [list(range(6))], "specularImageSize": 8, "irradianceCoefficients": [[0, 0, 0]] * 9}
    gltf.json["extensions"] = {"EXT_lights_image_based": {"lights": [light | more]}}
    gltf.json["scenes"][0]["extensions"] = {"EXT_lights_image_based": {"light": 0}}
    gltf.json["extensionsRequired"] = ["EXT_lights_image_based"]
    return load_scene(written(folder, "quad.glb", gltf.glb()))


def seen(scene: Scene, towards: Any) -> Any:
    """(n, 3) the radiance of the pixel whose middle is nearest to each direction (n, 3)."""
    assert scene.sky is not None
    radiance = scene.sky.radiance
    middles = directions(radiance.shape[1], radiance.shape[0]).reshape(-1, 3)
    return radiance.reshape(-1, 3)[(np.asarray(towards) @ middles.T).argmax(1)]


def even(colour: Any) -> bytes:
    return png(np.broadcast_to(np.asarray(colour, np.uint8), (8, 8, 3)))


def test_each_face_is_seen_where_it_is(tmp_path: Path) -> None:
    scene = with_sky(tmp_path, [even(c) for c in COLOURS], intensity=3.0)
    expected = 3 * linear_from_srgb(COLOURS.astype(np.float32) / 255)
    np.testing.assert_allclose(seen(scene, TOWARDS), expected, rtol=1e-5)


def test_it_is_turned_from_x_to_minus_z(tmp_path: Path) -> None:
    scene = with_sky(tmp_path, [even(c) for c in COLOURS], rotation=QUARTER)
    faces = linear_from_srgb(COLOURS.astype(np.float32) / 255)
    np.testing.assert_allclose(seen(scene, [(0, 0, -1), (1, 0, 0), (0, 1, 0)]), faces[[0, 4, 2]], rtol=1e-5)


@pytest.mark.parametrize(
    ("face", "right", "up"),
    [(0, (1, 0, 1), (1, 1, 0)), (4, (-1, 0, 1), (0, 1, 1)), (2, (-1, 1, 0), (0, 1, -1)), (3, (-1, -1, 0), (0, -1, 1))],
)
def test_a_face_looks_as_from_inside(tmp_path: Path, face: int, right: Any, up: Any) -> None:
    """Red to the right, green above, which is the upper row."""
    pixels = np.zeros((8, 8, 3), np.uint8)
    pixels[:, 4:, 0] = pixels[:4, :, 1] = 255
    scene = with_sky(tmp_path, [png(pixels) if k == face else even(0) for k in range(6)])
    middle = TOWARDS[face]
    at = seen(scene, [middle + 0.4 * (np.array(way) - middle) for way in (right, up)])
    way_back = seen(scene, [middle - 0.4 * (np.array(way) - middle) for way in (right, up)])
    assert at[0, 0] == at[1, 1] == 1 and way_back[0, 0] == way_back[1, 1] == 0


def test_an_even_one_lights_as_an_even_sky(tmp_path: Path) -> None:
    """Irradiance π L; colours of a picture with alpha are divided by it: 128 of 255 by 32 of 255."""
    out = io.BytesIO()
    Image.fromarray(np.tile(np.array([128, 128, 128, 32], np.uint8), (8, 8, 1))).save(out, "PNG")
    scene = with_sky(tmp_path, 6 * [out.getvalue()])
    assert scene.sky is not None and scene.lit_by_sky
    radiance = float(linear_from_srgb(np.array([128 / 255], np.float32))[0]) * 255 / 32
    np.testing.assert_allclose(scene.sky.shape_irradiance(np.eye(3)), np.pi * radiance, rtol=1e-5)


@pytest.mark.parametrize(
    ("faces", "more", "reason"),
    [
        (5 * [even(9)] + [b"none"], {}, "'image-based light 0', its face -Z is not a readable picture"),
        (5 * [even(9)] + [png(np.zeros((8, 4, 3)))], {}, "faces of 4×8, 8×8 pixels; they must be squares of one size"),
        (6 * [even(9)], {"specularImages": []}, "specularImages: List should have at least 1 item"),
        (6 * [even(9)], {"specularImages": [[0, 1, 2, 3, 4, 6]]}, "image 6 does not exist"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, faces: list[bytes], more: Any, reason: str) -> None:
    with pytest.raises(SceneError, match=reason.replace("+", r"\+")):
        with_sky(tmp_path, faces, **more)
