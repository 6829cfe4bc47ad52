"""The flat picture: a scene is seen as soon as it is read, before there is any light, and gone once that is there."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from solver_scenes import grey, quads_scene, room

from app.atlas.options import AtlasOptions
from app.atlas.parametrize import parametrize
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.render.camera import CameraView
from app.render.flat import MATERIAL, POSITION, TINT, FlatScene
from app.render.frame import FrameRenderer
from app.render.options import DisplayOptions
from app.session import loading
from app.session.session import Session
from app.session.view import View
from app.ui.app import Ui
from app.viewer.ui_frame import UiFrame, pixels

SIZE = (128, 128)


@pytest.fixture
def view(gpu: Gpu) -> Iterator[View]:
    session = Session(gpu, atlas=AtlasOptions(texels=900))
    view = View(session)
    yield view
    view.release()
    session.release()


def wait_for_flat(session: Session) -> None:
    until = time.monotonic() + 60
    while session.loading is not None and session.loading.flat is None:
        assert time.monotonic() < until, "was not read"
        time.sleep(0.001)


def test_a_scene_is_seen_before_it_is_unfolded_in_the_colours_of_its_materials(gpu: Gpu, view: View) -> None:
    texture = gpu.texture(SIZE, 4, "f1")
    target = gpu.target(texture)
    assert not view.draw_flat(target, SIZE), "nothing is on its way"
    view.session.open("cornell-box")
    wait_for_flat(view.session)
    assert not view.session.opened and view.draw_flat(target, SIZE)
    image = pixels(target, SIZE).astype(float)
    left, right, lamp = image[64, 12], image[64, 115], image[:40].min(2).max()
    assert left[0] > 2 * left[1] and right[1] > 1.5 * right[0]  # the red and the green wall
    assert lamp > 200  # seen from below, white
    until = time.monotonic() + 60
    while view.session.loading is not None:
        assert time.monotonic() < until, "did not load"
        view.session.poll()
        time.sleep(0.001)
    assert view.session.opened and not view.draw_flat(target, SIZE)
    gpu.release_all(target, texture)


def test_it_stays_flat_until_there_is_light(gpu: Gpu, view: View) -> None:
    """A window does not turn black between; from elsewhere, and while nothing shoots, it shows what there is."""
    session, size = view.session, (640, 360)
    texture, ui = gpu.texture(size, 4, "f1"), Ui(live=False)
    target, frame = gpu.target(texture), UiFrame(gpu, ui, whole=False)

    def seen() -> float:
        frame.draw(view, target, size=size)
        left, bottom, width, height = ui.view_rect
        image = np.frombuffer(texture.read(), np.uint8).reshape(size[1], size[0], 4)
        return float(
            image[bottom : bottom + height // 2, left : left + width, :3].mean()
        )  # below what says how far it is

    session.open("cornell-box")
    wait_for_flat(session)
    flat = [seen() for _ in range(4)][-1]
    while session.loading is not None:
        session.poll()
        time.sleep(0.001)
    assert view.waits_for_light and seen() == pytest.approx(flat, abs=5) and flat > 30  # but for what stands over it
    session.run.running = False
    dark = [seen() for _ in range(4)][-1]
    assert not view.waits_for_light and dark < flat / 3
    session.work(8)
    assert [seen() for _ in range(4)][-1] != dark
    frame.release()
    ui.release()
    gpu.release_all(target, texture)


def test_a_scene_in_which_nothing_emits_light_is_shown_flat(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """And as it is lit once something does, and in layers that are no light."""
    texture, renderer = gpu.texture(SIZE, 4, "f1"), FrameRenderer(gpu)
    target = gpu.target(texture)
    scene = quads_scene(room(), [grey(0.5)])
    lightmap = Lightmap.of(gpu, scene, parametrize(scene, texels=600))
    view = CameraView(np.eye(4), 1.6, 1.0)
    view.world_from_camera[:3, 3] = (0.5, 0.5, 0.9)

    def picture(**display: object) -> NDArray[np.int64]:
        renderer.render(target, SIZE, lightmap, view, DisplayOptions(**display))
        return pixels(target, SIZE).astype(np.int64)

    unlit, albedo = picture(), picture(layer="albedo")
    assert unlit[64, 64, 0] == pytest.approx(188, abs=1)  # sRGB of 0.5, seen straight on
    assert 80 < unlit[64, 2, 0] < 175, "a wall, seen askew"
    assert np.ptp(albedo[..., 0]) <= 1
    assert picture(false_colour="luminance")[64, 64, 0] < 100, "the colour of none"
    lightmap.set_materials((grey(0.5, 1e-9),))
    assert picture()[..., 0].max() < 8, "lit, if dimly"
    lightmap.set_materials((grey(0.5),))
    monkeypatch.setattr(FlatScene, "of", None)  # made once, whatever its materials are
    assert (picture() == unlit).all()
    lightmap.set_materials((grey(0.2),))
    assert picture()[64, 64, 0] == pytest.approx(124, abs=1)
    renderer.release()
    gpu.release_all(target, texture)
    lightmap.release()


def test_triangles_that_share_corners_keep_colours_of_their_own(rng: np.random.Generator) -> None:
    scene = replace(quads_scene([room()[0]], [grey(0.1), grey(0.9)]), material_ids=np.array([0, 1], np.int32))
    for colours in (None, rng.uniform(0, 1, (2, 3, 3)).astype(np.float32)):
        flat = FlatScene.of(replace(scene, colours=colours))
        corners = flat.vertices[flat.indices]
        np.testing.assert_allclose(corners[..., POSITION], flat.space.local_from_world(scene.corners), atol=1e-6)
        np.testing.assert_array_equal(corners[..., MATERIAL], [[0] * 3, [1] * 3])
        np.testing.assert_array_equal(corners[..., TINT], np.ones((2, 3, 3)) if colours is None else colours)


def test_nothing_is_seen_of_what_was_stopped(gpu: Gpu, view: View, monkeypatch: pytest.MonkeyPatch) -> None:
    texture = gpu.texture(SIZE, 4, "f1")
    target = gpu.target(texture)
    made = loading.charts_of
    monkeypatch.setattr(loading, "charts_of", lambda *args, **more: (time.sleep(0.3), made(*args, **more))[1])
    view.session.open("cornell-box")
    wait_for_flat(view.session)
    assert view.draw_flat(target, SIZE)
    assert view.session.loading is not None
    view.session.loading.cancel()
    view.session.poll()
    assert view.session.loading is None and not view.draw_flat(target, SIZE)
    gpu.release_all(target, texture)
