"""What a solver lets see beside its light: layers that only it can fill, the rays of a texel, and what it counts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from app.atlas.options import AtlasOptions
from app.cli import run
from app.gpu import Gpu, Texture
from app.render.layers import LAYER_SHADERS
from app.scene.model import F64
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View
from app.solvers import SOLVERS
from app.solvers.base import LAYERS
from app.solvers.gathering.options import GatheringOptions
from app.viewer.picture import picture

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
    assert {layer.offered for layer in LAYER_SHADERS.values()} - {""} == set(LAYERS), "each is shown by some layer"
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
    there = LAYER_SHADERS[layer].offered in SOLVERS["gathering"].layers
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
