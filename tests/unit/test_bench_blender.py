"""Blender's Cycles as a peer: what it is given, why it cannot run, and, where it can, that it bakes what we call irradiance."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from solver_scenes import grey, quads_scene, room

from app.atlas.options import AtlasOptions
from app.atlas.parametrize import parametrize
from app.atlas.points import random_points
from app.bench.peers import blender, peers
from app.bench.peers.blender import Baked
from app.errors import UserError
from app.lightmap.at_points import light_at
from app.lightmap.tile_pool import TilePool
from app.reference.irradiance import reference_irradiance
from app.scene.load import load_scene
from app.scene.model import Scene
from app.session.loading import read_and_unfold

posix = pytest.mark.skipif(sys.platform == "win32", reason="a script is no program there")


def silent(text: str, share: float) -> None:
    pass


def two_sided() -> Scene:
    """A furnace, B = H = 2, with a sheet in it that is lit and emits on both sides."""
    sheet = np.array([(0.4, 0.5, 0.4), (0.4, 0.5, 0.6), (0.6, 0.5, 0.6), (0.6, 0.5, 0.4)])
    return quads_scene([*room(), sheet], [grey(0.5, 1.0), grey(0.5, 1.0, double_sided=True)], [0] * len(room()) + [1])


# -- what it is given --------------------------------------------------------------------------------------------------


def test_each_lit_side_is_a_triangle_of_its_own() -> None:
    scene = two_sided()
    charts = parametrize(scene, texels=600)
    given = blender._described(scene, charts)
    fronts, backs = len(scene.triangles), int((scene.material_ids == 1).sum())
    corners, uv = given["corners"], given["uv_lightmap"]
    assert len(corners) == len(given["material"]) == fronts + backs == fronts + 2
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sheet = np.flatnonzero(scene.material_ids == 1)
    for front, back in zip(sheet, range(fronts, fronts + backs), strict=True):
        assert np.dot(normal[front], normal[back]) < 0, "turned over"
        apart = (corners[back].mean(0) - corners[front].mean(0)) @ normal[front] / np.linalg.norm(normal[front])
        assert apart == pytest.approx(-blender.GAP), "and behind it"
    # the coordinates follow the corners: each face has its chart's area, seen from the front
    for face in range(len(charts.face_triangle)):
        triangle = charts.face_triangle[face]
        row = fronts + list(sheet).index(triangle) if charts.face_back[face] else triangle
        (a, b), of_chart = np.diff(uv[row], axis=0) * charts.size, np.diff(charts.face_uv[face], axis=0)
        assert a[0] * b[1] - a[1] * b[0] == pytest.approx(abs(np.linalg.det(of_chart)), rel=1e-6)


def test_what_is_black_reflects_enough_to_be_baked() -> None:
    assert blender._material(grey(0.0, 0.0))[0]["albedo"] == [blender.LEAST_ALBEDO] * 3


def test_what_has_no_texels_is_baked_nowhere() -> None:
    scene = load_scene("cornell-box")
    charts = parametrize(scene, texels=600)
    uv = blender._described(scene, charts)["uv_lightmap"]
    front = np.isin(np.arange(len(uv)), charts.face_triangle[~charts.face_back])
    assert (uv[front] >= 0).all() and (uv[~front] == blender.NOT_BAKED).all()


def test_textures_have_their_factors_and_v_up() -> None:
    scene = load_scene("textured-room")
    given = blender._described(scene, parametrize(scene, texels=600))
    materials = json.loads(str(given["materials"]))
    k = next(k for k, m in enumerate(scene.materials) if m.albedo_texture is not None)
    texture = scene.materials[k].albedo_texture
    assert texture is not None and scene.uv0 is not None
    expected = np.maximum(texture.pixels * np.array(scene.materials[k].albedo), blender.LEAST_ALBEDO)
    np.testing.assert_allclose(given[f"albedo_{k}"], expected, rtol=1e-6)  # 32-bit floats
    assert materials[k]["albedo_look_up"] == ["Linear" if texture.bilinear else "Closest", "REPEAT"]
    first = int(np.flatnonzero(scene.material_ids == k)[0])
    u, v = scene.uv0[first][0] @ texture.uv_transform[:, :2].T + texture.uv_transform[:, 2]
    assert given["uv_albedo"][first][0] == pytest.approx([u, 1 - v])


# -- whether it can run ------------------------------------------------------------------------------------------------


@pytest.fixture(autouse=True)
def asked_anew() -> None:
    blender._has.cache_clear()


@pytest.mark.parametrize("program", ["nowhere/python", sys.executable])
def test_it_says_what_it_needs(monkeypatch: pytest.MonkeyPatch, program: str) -> None:
    monkeypatch.setenv(blender.PYTHON, program)
    reason = blender.no_cycles("no_such_module")
    assert reason is not None and blender.PYTHON in reason and "bpy and no_such_module" in reason


@posix
def test_a_bake_that_fails_is_one_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    program = tmp_path / "python"
    program.write_text("#!/bin/sh\necho Traceback >&2\necho 'Error: out of memory' >&2\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setenv(blender.PYTHON, str(program))
    scene = load_scene("furnace")
    with pytest.raises(UserError, match=r"^Cycles: Error: out of memory$"):
        blender.bake(scene, parametrize(scene, texels=600), 1, denoise=False)


# -- its curve ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["cycles", "cycles-oidn"])
def test_samples_double_until_the_time_is_over(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    scene = load_scene("furnace")
    reference, asked = reference_irradiance(scene, "closed-form", 1, silent), []

    def bake(scene: Scene, charts: object, samples: int, *, denoise: bool) -> Baked:
        asked.append(denoise)
        size = parametrize(scene, texels=600).size
        image = np.full((size[1], size[0], 3), 2.0 * (1 + 1 / samples), np.float32)
        return Baked(image, 1.0 * samples, 2.0 * samples, "Blender 0")

    monkeypatch.setattr(peers, "bake", bake)
    rows = peers.PEERS[name].curve(peers.Task(scene, reference, None, AtlasOptions(texels=600), 8.0))
    assert [row["paths"] for row in rows] == [1, 2, 4, 8] and set(asked) == {name == "cycles-oidn"}
    assert [row["rms"] for row in rows] == pytest.approx([1, 0.5, 0.25, 0.125])
    assert [row["cpu_seconds"] for row in rows] == [2.0, 4.0, 8.0, 16.0]
    _, _, charts, _ = read_and_unfold(scene, AtlasOptions(texels=600), False, silent)
    assert rows[0]["texels"] == TilePool(scene, charts).texel_count


@pytest.mark.skipif(not os.environ.get(blender.PYTHON), reason=f"{blender.PYTHON} names no Python")
def test_cycles_bakes_the_irradiance_that_we_mean() -> None:
    if (reason := blender.no_cycles("pyoidn")) is not None:
        pytest.skip(reason)
    scene = two_sided()
    charts = parametrize(scene, texels=1500)
    points = random_points(scene, 4000, 1)
    sheet = scene.material_ids[points.triangle] == 1
    assert points.back[sheet].any() and not points.back[sheet].all()
    for denoise, scatter in ((False, 0.2), (True, 0.1)):  # [W/m²], of 64 paths; what is left of it by the filter
        baked = blender.bake(scene, charts, 64, denoise=denoise)
        E = light_at(baked.irradiance, charts, points)
        # the mean of all texels scatters by less than 1 %, and the gap between the sheets takes far less
        assert E.mean() == pytest.approx(2.0, rel=0.01) and E.std() < scatter
        for back in (False, True):
            assert E[sheet & (points.back == back)].mean() == pytest.approx(2.0, rel=0.05)
        assert baked.seconds > 0 and baked.made.startswith("Blender ")
