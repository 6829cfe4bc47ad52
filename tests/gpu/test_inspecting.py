"""What a solver lets see beside its light: layers that only it can fill, the rays of a texel, and what it counts."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest

from app.atlas.options import AtlasOptions
from app.cli import run
from app.gpu import Gpu, Texture
from app.render.layers import LAYER_SHADERS, SEAMS
from app.render.tone_mapping import encode_srgb
from app.scene.model import F64
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View
from app.solvers import HEMISPHERE, SOLVERS
from app.solvers.base import LAYERS
from app.solvers.gathering.options import GatheringOptions
from app.ui import widgets
from app.viewer.picture import picture
from app.viewer.ui_frame import ui_image

RAYS = 32
SIZE = (96, 96)


@pytest.fixture
def view(gpu: Gpu) -> Iterator[View]:
    """The Cornell box, gathered along a few rays that are shown as they are."""
    session = Session(gpu, solver="gathering", options=GatheringOptions(smooth=False), atlas=AtlasOptions(texels=1500))
    view = View(session)
    session.open_now("cornell-box")
    session.solve(Stop(work=RAYS))
    yield view
    view.release()
    session.release()


def read(view: View, texture: Texture) -> F64:
    """Of every texel, (tiles, t, t, components)."""
    image = np.frombuffer(texture.read(), np.float32).reshape(*texture.size[::-1], texture.components)
    return view.session.lightmap.pool.tiles_from_image(image).astype(np.float64)


# -- layers ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SOLVERS)
def test_a_solver_fills_the_layers_that_its_family_names(gpu: Gpu, view: View, name: str) -> None:
    session = Session(gpu, solver=name, atlas=AtlasOptions(texels=900))
    session.open_now("furnace")
    session.work(8)
    layers = session.solver.layers
    assert tuple(layers) == SOLVERS[name].layers and set(layers) <= set(LAYERS)
    assert {layer.offered for layer in LAYER_SHADERS.values()} - {"", SEAMS} == set(LAYERS), (
        "each is shown by some layer"
    )
    for texture in layers.values():
        assert texture.size == session.lightmap.size
    session.release()


def test_direct_light_and_its_error_are_those_of_the_texels(view: View) -> None:
    layers, lightmap = view.session.solver.layers, view.session.lightmap
    direct = read(view, layers["direct"])[..., :3] * lightmap.unit
    H, covered = lightmap.irradiance().astype(np.float64), lightmap.pool.surfaces.area > 0
    assert (direct[covered] <= H[covered] * (1 + 1e-5) + 1e-9).all() and 0 < direct.sum() < H[covered].sum()
    ceiling = covered & (lightmap.pool.surfaces.position[..., 1] > 0.5485)
    assert direct[ceiling].max() == 0 and H[ceiling].min() > 0, "the lamp hangs below its ceiling"
    assert (read(view, layers["rays"])[covered] == RAYS).all()
    assert (read(view, layers["variance"])[covered] >= 0).all()


@pytest.mark.parametrize("layer", [name for name, layer in LAYER_SHADERS.items() if layer.offered])
def test_a_layer_is_shown_where_the_solver_has_it(view: View, layer: str) -> None:
    """Each of its own; another solver shows the light instead."""
    view.display = view.display.replace(layer="combined", exposure=1.0)
    light = picture(view, SIZE)
    view.display = view.display.replace(layer=layer)
    there = LAYER_SHADERS[layer].offered in (SEAMS, *SOLVERS["gathering"].layers)
    assert (layer in view.layers) == there and view.shown.layer == (layer if there else "combined")
    image = picture(view, SIZE)
    assert image.std() > 5 and (image == light).all() != there


def test_direct_and_indirect_light_are_all_light(view: View) -> None:
    """As the picture has them, without exposure and tone curve."""
    shown = {}
    for layer in ("irradiance", "direct", "indirect"):
        view.display = view.display.replace(layer=layer, tone_map="clamp", exposure=-1.0)
        srgb = picture(view, SIZE) / 255.0
        shown[layer] = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    inside = shown["irradiance"].max(-1) < 0.9
    box = (slice(10, -10), slice(10, -10))  # without the background
    off = np.abs(shown["direct"] + shown["indirect"] - shown["irradiance"])[box][inside[box]]
    assert inside[box].mean() > 0.5 and np.quantile(off, 0.95) < 0.02


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("--layer direct", "needs --solver gathering"),
        ("--layer residual --solver gathering", "needs --solver shooting"),
    ],
)
@pytest.mark.parametrize("command", ["shot cornell-box -o a.png", "view"])
def test_a_layer_that_the_solver_lacks_is_one_line(
    words: str, says: str, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([*command.split(), *words.split()]) == 2
    out, error = capsys.readouterr()
    assert out == "" and error.count("\n") == 1 and says in error


# -- rays of a texel ---------------------------------------------------------------------------------------------------


def texels(view: View, count: int) -> list[tuple[tuple[int, int], tuple[int, int, int]]]:
    """Some that cover a surface: (column, row) of the tile pool, and where they are among its tiles."""
    pool = view.session.lightmap.pool
    covered = np.argwhere(pool.surfaces.area > 0)
    chosen = covered[np.linspace(0, len(covered) - 1, count).astype(int)].tolist()
    return [((slot % pool.columns * 16 + x, slot // pool.columns * 16 + y), (slot, y, x)) for slot, y, x in chosen]


def nearest(corners: F64, start: F64, direction: F64) -> F64:
    """How far each ray gets (n,) through triangles (m, 3, 3), in float64 [Moller97]; infinite where it meets none."""
    a, b, c = np.moveaxis(corners, 1, 0)
    found = np.full(len(start), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for corner, u, v in zip(a, b - a, c - a, strict=True):
            p = np.cross(direction, v)
            det, away = p @ u, start - corner
            q = np.cross(away, u)
            x, y, t = (np.einsum("ij,ij->i", away, p) / det, np.einsum("ij,ij->i", direction, q) / det, q @ v / det)
            found = np.where((x >= 0) & (y >= 0) & (x + y <= 1) & (t > 1e-9), np.minimum(found, t), found)
    return found


def test_rays_end_where_they_hit(view: View) -> None:
    """Of all kinds of surfaces: as far as a search of all triangles finds, or outside."""
    lightmap, escaped = view.session.lightmap, 0
    corners = lightmap.space.local_from_world(lightmap.scene.corners.astype(np.float64))
    for texel, _ in texels(view, 12):
        rays = view.session.solver.inspect(texel, images=True).rays
        assert rays is not None and len(rays.start) == RAYS
        way = (rays.end - rays.start).astype(np.float64)
        length = np.linalg.norm(way, axis=1)
        right = nearest(corners, rays.start.astype(np.float64), way / length[:, None])
        off = np.abs(length - right)[np.isfinite(right)]
        assert np.mean(off < 2e-4) > 0.9 and np.median(off) < 2e-5, (
            "but where a texel of the atlas lies on two surfaces"
        )
        out = ~np.isfinite(right)
        assert (length[out] > 1.9).all() and rays.light[out].max(initial=0) == 0
        escaped += out.sum()
    assert escaped > 10, "the box is open"


def test_what_rays_bring_is_the_indirect_light(view: View) -> None:
    total = 0.0
    for texel, at in texels(view, 12):
        inspection = view.session.solver.inspect(texel, images=True)
        assert inspection.rays is not None
        brought, H = inspection.rays.light.mean(0), view.session.lightmap.irradiance()[at]
        np.testing.assert_allclose(inspection.texel_light["indirect"], brought, rtol=1e-4, atol=1e-6 * H.max() + 1e-9)
        np.testing.assert_allclose(sum(inspection.texel_light.values()), H, rtol=1e-5, atol=1e-9)
        total += brought.sum()
    assert total > 0


def test_rays_are_drawn_while_a_texel_is_marked(view: View) -> None:
    view.display = view.display.replace(exposure=1.0)
    plain = picture(view, SIZE)
    hit = view.pick(40, 85)
    assert hit is not None and {"direct", "indirect"} == set(hit.parts)
    view.marked = hit.texel
    changed = (picture(view, SIZE) != plain).any(-1)
    assert 0.02 < changed.mean() < 0.8
    view.session.set_solver("shooting")
    view.session.work(8)
    view.marked = None
    shot = picture(view, SIZE)
    view.marked = hit.texel
    assert (picture(view, SIZE) == shot).all(), "it has none"


def test_the_hemisphere_shows_what_the_texel_sees(view: View) -> None:
    """A disc with nothing around it, and each ray in the colour of its light where it leads: on the floor, left is left."""
    view.display = view.display.replace(exposure=0.5, tone_map="clamp")
    picture(view, SIZE)
    hit = view.pick(48, 88)
    assert hit is not None and hit.normal[1] > 0.99
    inspection = view.inspect(hit.texel)
    image, rays = inspection.images[HEMISPHERE], inspection.rays
    assert rays is not None
    edge = image.size[0]
    shown = np.frombuffer(image.read(), np.uint8).reshape(edge, edge, 4).astype(int)
    radius = np.hypot(*((np.indices((edge, edge)) + 0.5) * 2 / edge - 1))
    assert shown[..., 3][radius < 0.96].mean() > 250 and shown[..., 3][radius > 1.0].max() == 0
    way = (rays.end - rays.start) / np.linalg.norm(rays.end - rays.start, axis=1, keepdims=True)
    right = view.camera.world_from_camera[:3, 0]
    x, y = way @ right, way @ np.cross(right, [0.0, 1.0, 0.0])
    assert np.ptp(x) > 1 and np.ptp(y) > 1
    at = [np.floor((place / 1.02 + 1) / 2 * edge).astype(int) for place in (y, x)]
    expected = encode_srgb(np.clip(rays.light.astype(np.float64) / np.pi * 2.0**0.5, 0, 1)) * 255
    assert np.abs(shown[at[0], at[1], :3] - expected).max() <= 1.01
    assert view.inspect(None).images == {}


# -- counting ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "edit", [{"emission": (9.0, 12.0, 15.0)}, {"albedo": (0.2, 0.5, 0.3)}], ids=lambda edit: next(iter(edit))
)
def test_an_edit_traces_no_ray(view: View, edit: dict[str, tuple[float, float, float]]) -> None:
    """All light changes, and the counter that the panel shows stands still; until more rays are asked for."""
    session = view.session
    texels, before = session.lightmap.texel_count, session.lightmap.irradiance()
    assert session.stats.counts["Rays traced"] >= RAYS * texels and session.stats.counts_in_edit == {}
    index = next(i for i, m in enumerate(session.scene.materials) if m.emits == ("emission" in edit))
    session.set_material(index, dataclasses.replace(session.scene.materials[index], **edit))
    while session.work(8) == 0:
        pass
    session.run.settle()
    counted = session.stats.counts_in_edit["Rays traced"]
    assert not np.allclose(session.lightmap.irradiance(), before, rtol=0.05)
    assert 8 * texels <= counted < 16 * texels, "of the work that came after the edit"


def test_an_edit_is_shown_to_trace_nothing(view: View) -> None:
    session = view.session
    session.set_material(0, dataclasses.replace(session.scene.materials[0], albedo=(0.5, 0.5, 0.5)))
    assert session.work(8) == 0, "it follows the edit first"
    session.run.settle()
    assert session.stats.counts_in_edit == {"Rays traced": 0}


def test_figures_are_those_of_the_solution(view: View) -> None:
    stats = view.session.stats
    assert stats.figures["Rays per texel"] == f"{RAYS}, all kept"
    assert int(stats.figures["Bounces"]) == view.session.solver.bounces.steps > 1  # type: ignore[attr-defined]
    assert "Expected error" not in stats.figures, "noise is no error: see Compare"
    assert float(stats.figures["Kept hits"].split()[0]) > 0


def test_the_panel_counts(view: View, monkeypatch: pytest.MonkeyPatch) -> None:
    told: dict[str, dict[str, str]] = {}
    monkeypatch.setattr(widgets, "facts", lambda name, rows: told.update({name: dict(rows)}))
    session = view.session
    session.set_material(0, dataclasses.replace(session.scene.materials[0], albedo=(0.5, 0.5, 0.5)))
    session.work(8)
    session.run.settle()
    ui_image(view, (900, 700))
    assert told["figures"]["Rays traced"].startswith(f"{session.stats.counts['Rays traced']:,}, ")
    assert told["figures"]["Rays traced"].endswith("/s\n0 since the edit")
    session.set_solver("shooting")
    ui_image(view, (900, 700))
    assert told["figures"] == {}
