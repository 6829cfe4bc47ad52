"""Opacity as files say it: alpha of glTF, transmission, d and Tr of MTL, TOML."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from app.scene.load import load_scene
from app.scene.model import Material
from tests.unit.scene_files import quad_gltf, written

ALPHA = np.array([[255, 0], [102, 204]], np.uint8)  # 1, 0, 0.4, 0.8


def picture(alpha: Any) -> bytes:
    """A red picture with this alpha, as PNG."""
    alpha, out = np.asarray(alpha, np.uint8), io.BytesIO()
    red = np.broadcast_to(np.array([255, 0, 0], np.uint8), (*alpha.shape, 3))
    Image.fromarray(np.concatenate([red, alpha[..., None]], -1)).save(out, "PNG")
    return out.getvalue()


def of_gltf(folder: Path, alpha: Any = ALPHA, factor: float = 1.0, **keys: Any) -> Material:
    """The quad's material, with a picture of this alpha and more keys."""
    gltf = quad_gltf()
    gltf.json["images"] = [{"bufferView": gltf.view(picture(alpha))}]
    gltf.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = [1, 1, 1, factor]
    gltf.json["materials"][0] |= keys
    return load_scene(written(folder, "quad.glb", gltf.glb())).materials[0]


def test_blend_is_the_factors_alpha_times_the_pictures(tmp_path: Path) -> None:
    material = of_gltf(tmp_path, factor=0.5, alphaMode="BLEND")
    assert (material.opacity, material.opacity_cutoff, material.opaque) == (0.5, None, False)
    assert material.opacity_texture is not None and material.albedo_texture is not None
    assert np.allclose(material.opacity_texture.pixels[..., 0], [[1, 0], [0.4, 0.8]])
    assert material.opacity_texture.wrap == material.albedo_texture.wrap and not material.opacity_texture.bilinear


@pytest.mark.parametrize(("keys", "cutoff"), [({}, 0.5), ({"alphaCutoff": 0.25}, 0.25)])
def test_mask_has_a_cutoff(tmp_path: Path, keys: dict[str, Any], cutoff: float) -> None:
    material = of_gltf(tmp_path, alphaMode="MASK", **keys)
    assert (material.opacity_cutoff, material.opaque) == (cutoff, False)


@pytest.mark.parametrize(
    ("alpha", "factor", "mode", "opacity"),
    [
        (ALPHA, 0.5, "OPAQUE", 1.0),
        ([[255, 255]], 1.0, "BLEND", 1.0),
        ([[128, 200]], 1.0, "MASK", 1.0),
        ([[128, 200]], 0.7, "MASK", None),
        ([[128, 200]], 0.5, "MASK", 0.0),
        ([[0, 0]], 1.0, "BLEND", 0.0),
    ],
)
def test_an_opacity_that_is_even_needs_no_texture(
    tmp_path: Path, alpha: Any, factor: float, mode: str, opacity: float | None
) -> None:
    material = of_gltf(tmp_path, alpha, factor, alphaMode=mode)
    if opacity is None:
        assert material.opacity_texture is not None and not material.opaque
    else:
        assert (material.opacity, material.opacity_texture, material.opacity_cutoff) == (opacity, None, None)


@pytest.mark.parametrize(
    ("glass", "mode", "factor", "mean"),
    [
        ({"transmissionFactor": 0.9}, "OPAQUE", 1.0, 0.1),
        ({"transmissionFactor": 0.9}, "BLEND", 0.5, 0.1 * 0.5 * 0.55),
        ({"transmissionFactor": 0.5, "transmissionTexture": {"index": 0}}, "OPAQUE", 1.0, 0.5),
        ({"transmissionFactor": 0.5, "transmissionTexture": {"index": 0}}, "BLEND", 1.0, 0.5 * 0.55),
    ],
)
def test_transmission_lets_light_pass(
    tmp_path: Path, glass: dict[str, Any], mode: str, factor: float, mean: float
) -> None:
    material = of_gltf(tmp_path, factor=factor, alphaMode=mode, extensions={"KHR_materials_transmission": glass})
    texture = 1.0 if material.opacity_texture is None else float(material.opacity_texture.pixels.mean())
    assert material.opacity * texture == pytest.approx(mean)


TRIANGLE = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl glass\nf 1/1 2/2 3/3\n"


@pytest.mark.parametrize(
    ("lines", "opacity"), [("d 0.1", 0.1), ("Tr 0.9", 0.1), ("Tr 0.5\nd 0.1", 0.1), ("d -halo 0.1", 0.1), ("", 1)]
)
def test_mtl_says_opacity_or_its_opposite(tmp_path: Path, lines: str, opacity: float) -> None:
    written(tmp_path, "m.mtl", f"newmtl glass\nKd 0.9 0.9 0.9\n{lines}\n")
    material = load_scene(written(tmp_path, "m.obj", TRIANGLE)).materials[0]
    assert material.opacity == pytest.approx(opacity) and material.albedo == (0.9, 0.9, 0.9)


def test_map_d_is_the_alpha_of_its_picture_or_the_picture(tmp_path: Path) -> None:
    written(tmp_path, "m.mtl", "newmtl glass\nd 0.5\nmap_d leaf.png\n")
    file = written(tmp_path, "m.obj", TRIANGLE)
    grey = io.BytesIO()
    Image.fromarray(ALPHA).save(grey, "PNG")
    for data in (picture(ALPHA), grey.getvalue()):
        written(tmp_path, "leaf.png", data)
        material = load_scene(file).materials[0]
        assert material.opacity == 0.5 and material.albedo_texture is None and material.opacity_texture is not None
        assert np.allclose(material.opacity_texture.pixels[..., 0], [[1, 0], [0.4, 0.8]])


def test_authored_opacity(tmp_path: Path) -> None:
    quad = "[[quad]]\nmaterial = 'pane'\norigin = [0, 0, 0]\nedge_u = [1, 0, 0]\nedge_v = [0, 1, 0]"
    text = f"[[material]]\nname = 'pane'\nopacity = 0.1\n{quad}"
    assert load_scene(written(tmp_path, "pane.toml", text)).materials[0].opacity == 0.1
