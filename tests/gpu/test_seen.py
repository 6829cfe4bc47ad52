"""Which texels a camera sees, told by a small raster on the CPU, is what the picture shows; and light that reaches none of it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.render.camera import CameraView
from app.render.frame import FrameRenderer
from app.render.options import DisplayOptions
from app.render.seen import ROWS, seen_texels
from app.scene.cameras import default_camera, look_at
from app.scene.model import Camera, Material, Scene
from app.scene.shapes import Mesh, box
from app.scene.validate import Part, validate
from app.session.run import Stop
from app.session.session import Session
from app.session.view import BACKS, TRAPPED, View

GREY, LAMP = Material("grey"), Material("lamp", (0.0, 0.0, 0.0), (5.0, 5.0, 5.0))
SIZE = (ROWS * 16 // 9, ROWS)


def room_with(*parts: tuple[Mesh, int]) -> Scene:
    """A closed room of 4 m around meshes of grey (0) or lamps (1), seen from a corner."""
    pieces = [(box((4, 4, 4)).flipped(), 0), *parts]
    found = [Part(m.positions, m.triangles, i, k) for i, (m, k) in enumerate(pieces)]
    scene = validate("x", "x", found, ["x"] * len(pieces), [GREY, LAMP])
    camera = Camera("corner", look_at((1.8, 1.5, 1.8), (0, 0, 0)), 1.2)
    return dataclasses.replace(scene, cameras=(camera,))


def opened(gpu: Gpu, scene: Scene) -> View:
    session = Session(gpu, atlas=AtlasOptions(texels=3000))
    view = View(session)
    assert view.look_for_light() is None, "nothing is open: the window asks in every frame"
    session.open_now(scene)
    return view


def test_what_is_seen_is_what_a_picture_shows(gpu: Gpu) -> None:
    """The same surfaces, as often, as picking every pixel says: also where triangles reach behind the eye."""
    view = opened(gpu, room_with((box((1, 1, 1)), 0), (box((0.2, 0.2, 0.2)).moved(1, -1, 1), 1)))
    lightmap, camera = view.session.lightmap, view.camera
    seen = seen_texels(lightmap.pool, camera.world_from_camera, camera.yfov, SIZE[0] / SIZE[1])
    assert len(seen.slot) == pytest.approx(SIZE[0] * SIZE[1], rel=0.02), "the room is closed"
    renderer, target = FrameRenderer(gpu), gpu.target(gpu.texture(SIZE, 4, "f1"))
    renderer.render(target, SIZE, lightmap, camera, DisplayOptions())
    picked = np.bincount(
        [renderer.pick(x, y).triangle for x in range(0, SIZE[0], 2) for y in range(0, SIZE[1], 2)], minlength=36
    )
    triangle = lightmap.charts.face_triangle[lightmap.pool.surfaces.face[seen]]
    assert np.allclose(np.bincount(triangle, minlength=36) / len(triangle), picked / picked.sum(), atol=0.02)
    renderer.release()
    view.release()
    view.session.release()


def test_light_that_reaches_nothing_that_is_seen_is_said_to_be_trapped(
    gpu: Gpu, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And no longer where the camera has moved to where light is."""
    bulb, globe = box((0.1, 0.1, 0.1)), box((0.5, 0.5, 0.5))
    for scene, said in ((room_with((bulb, 1), (globe, 0)), TRAPPED), (room_with((bulb, 1)), None)):
        view = opened(gpu, scene)
        assert view.look_for_light() is None, "nothing is said before it is known"
        view.session.solve(Stop())
        solved = view.session.run.progress
        for left, message in ((0.02, None), (0.005, said)):
            view.session.run.progress = dataclasses.replace(solved, converged=False, remaining=left)
            assert view.look_for_light() == message == view.session.message, "before it has converged"
        view.session.run.progress = solved
        assert view.look_for_light() == said == view.session.message
        assert view.look_for_light() is None, "and once only"
        view.camera = CameraView(look_at((0.0, 0.0, 0.2), (0, 0, 0)), 1.2, 0.2)  # inside of the globe, at the bulb
        assert view.look_for_light() is None and view.session.message == said, "not in every frame of a flight"
        monkeypatch.setattr(view, "_look_due", 0.0)
        assert view.look_for_light() is None and view.session.message is None
        view.release()
        view.session.release()


@pytest.mark.parametrize("solver", ["shooting", "gathering"])
def test_light_behind_all_surfaces_is_said(gpu: Gpu, solver: str) -> None:
    """In a room of walls with one side whose fronts are outside, as programs for engineering write them."""
    parts = [Part(m.positions, m.triangles, 0, k) for m, k in ((box((4, 4, 4)), 0), (box((0.1, 0.1, 0.1)), 1))]
    view = View(Session(gpu, solver=solver, atlas=AtlasOptions(texels=1000)))
    scene = validate("x", "x", parts, ["x"], [GREY, LAMP])
    view.session.open_now(dataclasses.replace(scene, cameras=(default_camera(scene),)))
    view.session.solve(Stop())
    assert view.look_for_light() == BACKS == view.session.message
    view.release()
    view.session.release()
