"""The picture of coarse light in the window: whole, and up to date."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from coarse_light import better, frames, view

from app.gpu import Gpu
from app.render import resolve
from app.session import session as session_module
from app.session.pacing import SLOW_FRAME, Turns
from app.session.view import View
from app.ui.app import Ui
from app.viewer.ui_frame import UiFrame

__all__ = ["better", "view"]


@pytest.fixture
def seen(gpu: Gpu, view: View) -> Iterator[Callable[..., np.ndarray]]:
    """Draws a frame as the window does, ``look``: with the view anew; gives the view's lower half, below what says how far
    loading is."""
    size = 640, 360
    texture = gpu.texture(size, 4, "f1")
    target, ui = gpu.target(texture), Ui(live=False)
    frame = UiFrame(gpu, ui, whole=False)

    def seen(*, look: bool = True) -> np.ndarray:
        frame.draw(view, target, size=size, look=look)
        left, bottom, width, height = ui.view_rect
        image = np.frombuffer(texture.read(), np.uint8).reshape(size[1], size[0], 4)
        return image[bottom : bottom + height // 2, left : left + width].copy()

    yield seen
    frame.release()
    ui.release()
    gpu.release_all(target, texture)


def test_a_picture_at_rest_shows_all_of_the_coarse_light(
    view: View, seen: Callable[..., np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where a frame brings only a few of its texels up to date."""
    session = view.session
    monkeypatch.setattr(session_module, "COARSE_LEFT", 0.5)
    session.open("cornell-box")
    frames(session, lambda: session.opened)
    for _ in range(4):
        seen()  # the panels find their places
    monkeypatch.setattr(resolve, "TEXELS_PER_FRAME", 1)
    frames(session, lambda: session.run.resting)
    at_rest = [seen() for _ in range(2)][-1]
    monkeypatch.setattr(resolve, "TEXELS_PER_FRAME", 1 << 20)
    view.display = view.display.replace(exposure=view.display.exposure + 1)
    seen()
    view.display = view.display.replace(exposure=view.display.exposure - 1)
    all_of_it = seen()
    assert session.coarse and all_of_it.std() > 10
    assert np.array_equal(at_rest, all_of_it)


def test_coarse_light_is_seen_where_solving_and_drawing_take_turns(
    view: View, seen: Callable[..., np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Frames that solve do not draw, and so the next one must; where the camera moved in one, too."""
    session, turns, pictures = view.session, Turns(), []
    session.open("cornell-box")
    frames(session, lambda: session.opened)
    for _ in range(4):
        seen()  # the panels find their places
    for _ in range(6):
        solve, look = turns.next(1.1 * SLOW_FRAME)
        if solve:
            session.work()
        pictures.append((solve, look, seen(look=look)))
    anew = [not np.array_equal(one[-1], other[-1]) for one, other in itertools.pairwise(pictures)]
    looked = [look for _, look, _ in pictures[1:]]
    assert session.coarse and anew == looked and set(looked) == {False, True}
    monkeypatch.setattr(session_module, "COARSE_LEFT", 1.0)
    session.poll()
    frames(session, lambda: session.run.resting)
    before = seen()
    view.camera = dataclasses.replace(view.camera, yfov=0.5)
    assert np.array_equal(seen(look=False), before)
    assert not np.array_equal(seen(), before)
