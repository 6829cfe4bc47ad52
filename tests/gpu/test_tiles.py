"""Leaves of 8, 16 and 32 texels along the edge: the same light and the same picture, and every program hears of it."""

from __future__ import annotations

import re
import time

import numpy as np
import pytest
from numpy.typing import NDArray
from pictures import render_image
from solver_scenes import EVERY_LIGHTMAP, begin, solve, table_room

from app.atlas.charts import TILES
from app.atlas.options import AtlasOptions
from app.atlas.parametrize import parametrize
from app.gpu import Gpu, ShaderLibrary
from app.gpu.shader import SHADERS, Source
from app.lightmap.lightmap import Lightmap
from app.lightmap.options import LightmapOptions
from app.render.camera import CameraView
from app.render.options import LAYERS, DisplayOptions
from app.render.resolve import PLACES_WIDTH
from app.scene.load import load_scene
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View
from app.solvers import ShootingOptions
from app.solvers.shooting.options import MAX_LEVEL, highest_level

SIZE = (160, 120)


def test_every_program_that_asks_for_the_tile_is_told(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever forgets it gets the default, and no error."""
    library = ShaderLibrary(gpu.ctx)
    monkeypatch.setattr(gpu, "shaders", library)
    light = LightmapOptions(adaptive=True, gradient=0.1)
    options = ShootingOptions(resolution=64, residual=0.5)
    session = Session(gpu, options=options, atlas=AtlasOptions(texels=500, tile=8), light=light)
    view = View(session)
    session.open_now("cornell-box")
    session.solve(Stop(work=40))
    texture = gpu.texture(SIZE, 4, "f1")
    target = gpu.target(texture)
    for layer in LAYERS:
        view.display = view.display.replace(layer=layer)
        view.draw(target, SIZE)
    asked = []
    for key in library._programs:
        name, defines, slots, vertex = str(key[0]), dict(key[1]), dict(key[2]), str(key[3])  # type: ignore[call-overload]
        own = (SHADERS / f"{name}.vert.glsl").exists()
        for stage in (f"{name if own else vertex}.vert.glsl", f"{name}.frag.glsl"):
            text = Source(SHADERS, stage, {}, slots, set()).text
            if re.search(r"#define TILE\b", text):
                asked.append(name)
                assert defines.get("TILE") == 8, name
    assert {"render/source", "render/resolve", "render/edges", "lightmap/push", "lightmap/judge"} <= set(asked)
    assert {
        "solvers/shooting/choose",
        "solvers/shooting/patches",
        "solvers/shooting/tile_energy",
    } <= set(asked)
    view.release()
    session.release()
    gpu.release_all(target, texture)
    library.release()


def pictures(gpu: Gpu, display: DisplayOptions, light: float) -> list[NDArray[np.uint8]]:
    """The box with light that grows along an axis of each rectangle, for every size of leaf."""
    scene, made = load_scene("textured-room"), []
    for tile in TILES:
        lightmap = Lightmap.of(gpu, scene, parametrize(scene, texels=20_000, tile=tile))
        assert tile > 8 or lightmap.tiles > PLACES_WIDTH, "pixels look in more than one row of the table of places"
        surfaces = lightmap.pool.surfaces
        H = np.where((surfaces.area > 0)[..., None], light * (1.0 + surfaces.position - scene.bounds[0]), 0.0)
        image = lightmap.pool.image_from_tiles(np.concatenate([H, H[..., :1]], -1) / lightmap.unit)
        lightmap.texture("t_irradiance").write(np.ascontiguousarray(image, np.float32).tobytes())
        camera = scene.cameras[0]
        distance = float(np.linalg.norm(camera.world_from_camera[:3, 3] - lightmap.space.centre))
        made.append(render_image(gpu, lightmap, CameraView.from_camera(camera, distance), display, SIZE))
        lightmap.release()
    return made


@pytest.mark.parametrize("layer", ["irradiance", "albedo"])
def test_the_picture_does_not_depend_on_the_tile(gpu: Gpu, layer: str) -> None:
    """Charts lie elsewhere in the atlas, their texels are the same. Half a step of 8 bits on either side."""
    first, *others = (p.astype(int) for p in pictures(gpu, DisplayOptions(layer=layer, tone_map="clamp"), 0.3))
    assert first.std() > 10
    for other in others:
        assert np.abs(other - first).max() <= 1


def test_lines_of_the_grid_are_as_far_apart_as_tiles(gpu: Gpu) -> None:
    """Twice the edge, half the lines."""
    plain = DisplayOptions(layer="irradiance", tone_map="clamp")
    bare = pictures(gpu, plain, 0.3)
    ruled = pictures(gpu, plain.replace(grid=True), 0.3)
    marked = [int((np.abs(r.astype(int) - b) > 20).any(-1).sum()) for r, b in zip(ruled, bare, strict=True)]
    assert marked[0] > 1.5 * marked[1] > 2.2 * marked[2] > 0, marked


@EVERY_LIGHTMAP
def test_the_light_does_not_depend_on_the_tile(gpu: Gpu, adaptive: bool) -> None:
    """Means over each object's area. What is still unshot is that of other patches each time, and makes twice its light."""
    options: dict[str, object] = {"density": 4.0, "level": 1, "resolution": 64, "residual": 0.015, "adaptive": adaptive}
    means = []
    for tile in (8, 32):
        mine = solve(gpu, table_room(), tile=tile, **options)  # type: ignore[arg-type]
        means.append(mine.means(mine.H))
        # made or lost by patches of half a metre at contacts, where shots are too weak to be audited: up to 1.1 %
        assert abs(mine.book.imbalance_share) < 0.012
        mine.release()
    np.testing.assert_allclose(*means, rtol=0.03)


@pytest.mark.usefixtures("undivided")
@pytest.mark.parametrize(("adaptive", "density"), [(False, 8.0), (True, 4.0)], ids=["uniform", "adaptive"])
def test_no_patch_is_larger_than_its_leaf(gpu: Gpu, adaptive: bool, density: float) -> None:
    """On quadtrees, the lamp's leaves begin two levels below the roots: those of the others shoot from smaller patches."""
    assert [highest_level(tile) for tile in TILES] == [3, 4, 4]
    for tile in TILES:
        room = begin(gpu, table_room(), density=density, tile=tile, level=MAX_LEVEL, resolution=64, adaptive=adaptive)
        room.step(1)
        room.solver.poll(wait=True)
        assert room.solver.last_shot is not None and room.solver.last_shot.size == min(tile, 16)
        pool = room.lightmap.pool
        assert max(room.solver.patch_edge(pool.corner(slot)) for slot in range(pool.tiles)) == min(tile, 16)
        room.release()


def test_another_tile_cuts_the_open_scene_anew(gpu: Gpu) -> None:
    session = Session(gpu, atlas=AtlasOptions(texels=900))
    session.open_now("cornell-box")
    before = session.stats
    session.cut_anew(session.atlas.replace(tile=8))
    while session.loading is not None:
        session.poll()
        time.sleep(0.001)
    after = session.stats
    assert (session.charts.tile, session.parameters["atlas"]["tile"]) == (8, 8)
    assert after.texels == before.texels and after.tiles > before.tiles
    session.release()
