"""The reference irradiance that errors are measured from: closed form, dense matrix, traced paths, gaps, cache."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from solver_scenes import grey, quads_scene, room, with_uv

from app.atlas.points import random_points
from app.reference import irradiance
from app.reference.closed_form import no_furnace
from app.reference.gaps import open_above
from app.reference.irradiance import ReferenceIrradiance
from app.reference.metrics import relative_rms
from app.reference.patches import texture_at
from app.scene.arrays import arrays_of
from app.scene.load import load_scene
from app.scene.model import Material, Scene, Texture
from app.scene.sky import SUN_ANGLE, Sky, Sun
from app.util import cache


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(tmp_path / "cache"))
    return tmp_path / "cache"


def silent(text: str, share: float) -> None:
    pass


def furnace(albedo: float = 0.5, **changes: Any) -> Scene:
    return quads_scene(room(), [grey(albedo, 1.0, **changes)])


# -- closed form, dense, cache ------------------------------------------------------------------------------------------


def test_a_furnace_is_known_in_closed_form() -> None:
    known = irradiance.reference_irradiance(furnace(0.75), "closed-form", 1, silent)
    assert irradiance.choose_reference(furnace()) == "closed-form"
    assert np.allclose(known.E, 1.0 / (1 - 0.75)) and known.noise is None and known.lit.all()


def test_what_is_no_furnace() -> None:
    walls = room()
    scenes = {
        "open": quads_scene(walls[1:], [grey(0.5, 1.0)]),
        "seen from outside": quads_scene(walls[:, ::-1], [grey(0.5, 1.0)]),
        "two rooms": quads_scene([*walls, *(walls + 5)], [grey(0.5, 1.0)]),
        "two materials": quads_scene(walls, [grey(0.5, 1.0), grey(0.4, 1.0)], [0, 0, 0, 0, 0, 1]),
        "two sides": furnace(double_sided=True),
        "no absorption": furnace(1.0),
    }
    assert no_furnace(furnace()) is None
    assert [name for name, scene in scenes.items() if no_furnace(scene) is None] == []


def test_the_dense_matrix_agrees_with_the_closed_form() -> None:
    """Rows of the matrix sum to 1 in a closed convex room, whatever the patches."""
    known = irradiance.dense_irradiance(furnace(), count=50, patches=100)
    assert np.allclose(known.E, 2.0, rtol=1e-9) and len(known.points) == 50


def test_points_in_gaps_are_left_out() -> None:
    scene = load_scene("cornell-box")
    points = random_points(scene, 400, 5)
    free = open_above(scene, points, 1e-3)  # m; the lamp hangs 0.1 mm below the ceiling
    position, normal = points.positions_normals(scene)
    assert 0 < (~free).sum() < 20
    for x, n in zip(position[~free], normal[~free], strict=True):
        assert not open_above(scene, points.only((position == x).all(axis=1)), 1e-3).any()
        assert abs(n[1]) == 1.0, "only floor and ceiling have something so close above them"


def test_the_cache_is_hit_and_its_key_changes(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    solve = irradiance.solve_dense
    monkeypatch.setattr(irradiance, "solve_dense", lambda *given: (calls.append(1), solve(*given))[1])
    scene = furnace()

    def made(scene: Scene, **changes: int) -> ReferenceIrradiance:
        return irradiance.dense_irradiance(scene, **({"count": 20, "patches": 40} | changes))

    first, again = made(scene), made(scene)
    assert len(calls) == 1 and (again.E == first.E).all() and again.seconds == first.seconds
    assert (again.points.triangle == first.points.triangle).all() and len(again.points) == len(again.E)
    moved = furnace()
    moved.positions[0] += 0.01
    for other, changes in ((moved, {}), (furnace(0.6), {}), (scene, {"patches": 50}), (scene, {"count": 21})):
        before = len(calls)
        made(other, **changes)
        assert len(calls) == before + 1, changes
    assert len(list(own_cache.glob("truth/*.npz"))) == 5
    for file in own_cache.glob("truth/*.npz"):
        file.write_bytes(file.read_bytes()[:99])
    assert (made(scene).E == first.E).all() and len(calls) == 6, "a damaged file is made again"


def test_textures_and_sides_are_part_of_the_key() -> None:
    scene = load_scene("textured-room")
    whole = cache.digest(b"", arrays_of(scene))
    textured = next(k for k, m in enumerate(scene.materials) if m.albedo_texture is not None)
    for change in (
        {"double_sided": not scene.materials[textured].double_sided},
        {"albedo_texture": replace(scene.materials[textured].albedo_texture, wrap=("clamp", "clamp"))},
        {"albedo_texture": None},
        {"name": "another"},
    ):
        materials = list(scene.materials)
        materials[textured] = replace(materials[textured], **change)
        other = cache.digest(b"", arrays_of(scene.with_materials(tuple(materials))))
        assert (other == whole) == ("name" in change), change


# -- path tracing ------------------------------------------------------------------------------------------------------


@pytest.fixture
def tracer() -> Any:
    """Where mitsuba is installed and runs; skipped elsewhere."""
    pytest.importorskip("mitsuba", reason="of the extra peers")
    if (reason := irradiance.no_tracer()) is not None:
        pytest.skip(reason)
    from app.reference import path_tracer as tracer

    return tracer


def test_paths_in_a_furnace(tracer: Any) -> None:
    known = irradiance.path_traced_irradiance(furnace(), 256, silent, count=100)
    assert 0.001 < known.noise < 0.02
    # of 100 points the mean is ten times as exact; five of those
    assert known.E.mean() == pytest.approx(2.0, rel=0.5 * known.noise)
    assert relative_rms(known.E, np.full_like(known.E, 2.0)) == pytest.approx(known.noise, rel=0.5)


def test_a_lamp_that_shines_both_ways(tracer: Any) -> None:
    """A square halfway between floor and ceiling, without anything else: both get the same, and the walls' backs nothing."""
    quads = [*room((2.0, 2.0, 2.0))[:2], [[0.5, 1, 0.5], [0.5, 1, 1.5], [1.5, 1, 1.5], [1.5, 1, 0.5]]]
    scene = quads_scene(quads, [grey(0.0), grey(0.0, 1.0, double_sided=True)], [0, 0, 1])
    place = np.array([[1.0, 0, 1], [1.0, 2, 1]]), np.array([[0.0, 1, 0], [0.0, -1, 0]])
    E = tracer.Tracer(scene).irradiance(*place, 4096, 3)
    # C-11's element in the middle: 4 / 2π · 2 · (x / √(1 + x²)) atan(x / √(1 + x²)), x = 1/2
    x = 0.5 / np.sqrt(1.25)
    assert E == pytest.approx(4 / np.pi * x * np.arctan(x), rel=0.02)


def test_the_sun_is_a_disc(tracer: Any) -> None:
    """A straight edge 10 m above a floor, the sun overhead: half of its disc is seen from below the edge, from half its radius
    beside that the share beyond a chord, as of any disc."""
    edge = [[0.0, 10, -5], [-9, 10, -5], [-9, 10, 5], [0, 10, 5]]
    dark = np.zeros((2, 4, 3), np.float32)
    sky = Sky("image", sun=Sun(0.0, 90.0), image=dark)
    scene = quads_scene([edge], [grey(0.0, double_sided=True)]).with_sky(sky)
    x = np.array([-1.1, -0.5, 0.0, 0.5, 1.1])  # radii from the middle
    place = np.outer(x * 10 * np.tan(SUN_ANGLE / 2), [1.0, 0, 0]), np.tile([0.0, 1, 0], (5, 1))
    E = tracer.Tracer(scene).irradiance(*place, 16384, 1)
    beyond = (np.arccos(0.5) - 0.5 * np.sqrt(0.75)) / np.pi
    assert E / sky.sun_irradiance == pytest.approx(np.outer([0, beyond, 0.5, 1 - beyond, 1], np.ones(3)), abs=0.02)


@pytest.mark.parametrize("cutoff", [None, 0.6])
def test_paths_pass_what_is_not_opaque(tracer: Any, cutoff: float | None) -> None:
    """Under a lamp behind two black sheets without a rim, one half of each there: a quarter of what it gives; of sheets that are
    cut out in stripes, one over the holes of the other, nothing."""
    stripes = Texture("stripes", np.array([[[0.5], [0.7]]], np.float32), bilinear=False)
    over = replace(stripes, uv_transform=np.array([[1, 0, 0.5], [0, 1, 0]]))
    sheet = replace(grey(0.0, double_sided=True), opacity=0.5)
    if cutoff is not None:
        sheet = replace(sheet, opacity=1.0, opacity_texture=stripes, opacity_cutoff=cutoff)
    other = sheet if cutoff is None else replace(sheet, opacity_texture=over)
    wide = np.array([[-50.0, 0, -50], [-50, 0, 50], [50, 0, 50], [50, 0, -50]])
    lamp = np.array([[-1.0, 3, -1], [1, 3, -1], [1, 3, 1], [-1, 3, 1]])
    place = np.array([[0.0, 0, 0]]), np.array([[0.0, 1, 0]])
    lit = []
    for sheets in ([], [sheet], [sheet, other]):
        quads = [lamp, *(wide + np.array([0, 1 + 1e-3 * k, 0]) for k in range(len(sheets)))]
        scene = with_uv(quads_scene(quads, [grey(0.0, 1.0), *sheets], range(len(quads))))
        lit.append(float(tracer.Tracer(scene).irradiance(*place, 16384, 1).mean()))
    # of 16384 rays to the lamp the share that comes through is right to 1 %
    assert lit[1] == pytest.approx(lit[0] / 2, rel=0.04)
    assert lit[2] == pytest.approx(lit[0] / 4 if cutoff is None else 0.0, rel=0.04, abs=1e-3 * lit[0])


def test_vertex_colours_are_a_factor_of_the_albedo(tracer: Any) -> None:
    painted = furnace(0.8)
    painted = replace(painted, colours=np.full((len(painted.triangles), 3, 3), 0.625, np.float32))
    place = np.array([[1.0, 0, 1]]), np.array([[0.0, 1, 0]])
    E = [tracer.Tracer(scene).irradiance(*place, 256, 3) for scene in (painted, furnace(0.5), furnace(0.8))]
    assert E[0] == pytest.approx(E[1], rel=1e-5) and E[2].mean() > 1.5 * E[1].mean()


@pytest.mark.parametrize("channel", ["emission", "albedo"])
def test_textures_lie_as_the_solver_has_them(tracer: Any, channel: str) -> None:
    """Close to a square with four colours each point sees the one that the dense reference looks up there; turned over or shifted
    they are others."""
    pixels = np.array([[[1, 0, 0], [0, 1, 0]], [[0, 0, 1], [1, 1, 1]]], np.float32)
    texture = Texture(
        "four", pixels, ("repeat", "repeat"), bilinear=False, uv_transform=np.array([[1, 0, 0.5], [0, -1, 1]])
    )
    if channel == "emission":
        material = Material("glows", (0.0,) * 3, (2.0,) * 3, emission_texture=texture)
    else:
        material = Material("reflects", (0.5,) * 3, albedo_texture=texture)
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    sky = square[::-1] * 4 + [-1.5, -1.5, 1.0]  # lights the square almost evenly
    scene = quads_scene([square, sky], [material, grey(0.0, 1.0)], [0, 1])
    corners = square[:, :2].astype(np.float32)[[[0, 1, 2], [0, 2, 3]]]
    scene = replace(scene, uv0=np.concatenate([corners, np.zeros_like(corners)]))
    uv = np.array([[0.2, 0.3], [0.2, 0.8], [0.7, 0.3], [0.7, 0.8]])
    above = np.column_stack([uv, np.full(4, 0.01)])  # sees the colour below in all but about 1 % of directions
    E = tracer.Tracer(scene).irradiance(above, np.tile([0.0, 0, -1], (4, 1)), 4096, 1)
    seen = texture_at(texture, uv)
    assert len(np.unique(seen, axis=0)) == 4
    assert pytest.approx(seen, abs=0.05) == E / E.max()
