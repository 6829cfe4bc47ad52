"""The flat picture: a scene is seen as soon as it is read, before there is any light, and gone once that is there."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.session import loading
from app.session.session import Session
from app.session.view import View
from app.viewer.ui_frame import pixels

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
