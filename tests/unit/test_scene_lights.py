"""Lamps without area: what they send out, and how files say so."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bake_scenes import sides_charts, sides_scene
from scene_files import quad_gltf, written

from app.bake.gltf_writer import glb_bytes
from app.errors import SceneError
from app.scene.lights import Light
from app.scene.load import load_scene
from app.scene.model import Scene
from app.scene.options import FileOptions

TURNED = [0.0, math.sin(math.pi / 8), 0.0, math.cos(math.pi / 8)]  # 45 degrees about y: -z becomes -x -z
SLANT = (-math.sqrt(0.5), 0.0, -math.sqrt(0.5))


def with_light(folder: Path, light: dict[str, Any], **options: str) -> Scene:
    """A quad, and a light at (1, 2, 3) whose node is scaled and turned."""
    gltf = quad_gltf()
    gltf.json["extensions"] = {"KHR_lights_punctual": {"lights": [light]}}
    node = {"translation": [1, 2, 3], "scale": [5, 5, 5], "extensions": {"KHR_lights_punctual": {"light": 0}}}
    gltf.json["nodes"].append(node | {"rotation": TURNED})
    gltf.json["scenes"][0]["nodes"].append(len(gltf.json["nodes"]) - 1)
    return load_scene(written(folder, "quad.glb", gltf.glb()), FileOptions().replace(**options))


@pytest.mark.parametrize("units", [("photometric", 1 / 683), ("radiometric", 1.0), ("watts", 1 / (4 * math.pi))])
def test_a_spot_of_gltf_shines_along_minus_z(tmp_path: Path, units: tuple[str, float]) -> None:
    """Whatever the scale of its node; inner and outer cone, colour and range as the file has them."""
    spot = {"innerConeAngle": 0.1, "outerConeAngle": 0.4}
    file = {"type": "spot", "color": [1, 0.5, 0], "intensity": 683, "range": 9, "spot": spot}
    scene = with_light(tmp_path, file, light_units=units[0])
    (light,) = scene.lights
    assert scene.lit_by_lights and light.kind == "spot"
    assert np.allclose(light.intensity, 683 * units[1] * np.array([1, 0.5, 0]))
    assert light.position == (1, 2, 3) and np.allclose(light.direction, SLANT)
    assert (light.inner, light.outer, light.range) == (0.1, 0.4, 9)


def test_what_a_file_leaves_out(tmp_path: Path) -> None:
    """1 cd or lx, white, without end; cones of 0 and 45 degrees."""
    (light,) = with_light(tmp_path, {"type": "spot"}).lights
    assert np.allclose(light.intensity, 1 / 683) and math.isinf(light.range)
    assert (light.inner, light.outer) == (0, math.pi / 4)
    (sun,) = with_light(tmp_path, {"type": "directional"}, light_units="watts").lights
    assert np.allclose(sun.intensity, 1)


def test_odd_lights_are_held_and_said(tmp_path: Path) -> None:
    odd = {"type": "spot", "intensity": -1, "spot": {"innerConeAngle": 3, "outerConeAngle": 2}}
    scene = with_light(tmp_path, odd)
    assert scene.lights[0].inner == scene.lights[0].outer == math.pi / 2 and not scene.lit_by_lights
    assert any("intensity below 0" in w for w in scene.warnings) and any("cones" in w for w in scene.warnings)
    with pytest.raises(SceneError, match="range"):
        with_light(tmp_path, {"type": "point", "range": 0})
    with pytest.raises(SceneError, match="type"):
        with_light(tmp_path, {"type": "area"})


def test_units_are_lengths_of_lights_too(tmp_path: Path) -> None:
    (light,) = with_light(tmp_path, {"type": "point", "intensity": 683, "range": 9}, unit="cm", up="z").lights
    assert np.allclose(light.position, (0.01, 0.03, -0.02)) and light.range == pytest.approx(0.09)
    assert np.allclose(light.intensity, 1)


def test_toml(tmp_path: Path) -> None:
    quad = '[[material]]\nname="m"\n[[quad]]\nmaterial="m"\norigin=[0,0,0]\nedge_u=[100,0,0]\nedge_v=[0,0,-100]\n'
    text = '[scene]\nunit="cm"\n' + quad + "[[light]]\n"
    lamp = 'kind="spot"\nintensity=2\nposition=[0,100,0]\ntarget=[0,0,0]\nouter_deg=30\nradius=5\n'
    (light,) = load_scene(written(tmp_path, "a.toml", text + lamp)).lights
    assert light == Light("light 1", "spot", (2, 2, 2), (0, 1, 0), (0, -1, 0), 0, math.radians(30), radius=0.05)
    for wrong, why in (
        ("intensity=1", "needs a position"),
        ('kind="directional"\nintensity=1', "needs either a direction"),
        ('kind="directional"\ndirection=[0,-1,0]\nintensity=1\nradius=1', "has no radius"),
        ('kind="spot"\nposition=[0,1,0]\ndirection=[0,-1,0]\ninner_deg=50\nintensity=1', "inner_deg must be"),
    ):
        with pytest.raises(SceneError, match=why):
            load_scene(written(tmp_path, "a.toml", text + wrong))
    with pytest.raises(SceneError, match="--light-units watts"):
        load_scene(written(tmp_path, "a.toml", text + lamp), FileOptions(light_units="watts"))


def test_a_bake_has_its_lights(tmp_path: Path) -> None:
    lights = (
        Light("spot", "spot", (1, 2, 3), (0.5, 1, 0.2), (0.6, -0.8, 0), 0.2, 0.5, 8.0, 0.1),
        Light("sun", "directional", (3, 2, 1), (0, 0, 0), (0, -1, 0), outer=math.pi / 4, angle=0.01),
    )
    scene = sides_scene().with_lights((*lights, replace(lights[0], on=False)))
    written_file = written(tmp_path, "scene.glb", glb_bytes(scene, sides_charts(scene), ["lightmap.exr"]))
    for light, back in zip(lights, load_scene(written_file).lights, strict=True):
        assert (light.name, light.kind) == (back.name, back.kind)
        for name in ("intensity", "position", "direction", "inner", "outer", "range", "radius", "angle"):
            assert np.allclose(getattr(light, name), getattr(back, name)), name


def test_what_a_spot_sends_out_is_the_integral_of_its_falloff() -> None:
    for inner, outer in ((0.0, 0.7), (0.3, 0.5), (0.5, 0.5)):
        spot = Light("spot", "spot", inner=inner, outer=outer)
        s, o = spot.slope
        angle = (np.arange(200_000) + 0.5) * outer / 200_000
        density = np.clip(s * np.cos(angle) + o, 0, 1) ** 2 * np.sin(angle)
        assert spot.solid_angle == pytest.approx(2 * math.pi * density.sum() * outer / 200_000, rel=1e-4)
