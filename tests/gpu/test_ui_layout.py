"""Panels side by side, the view in its place, and pictures with the interface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from desks import SIZE, Desk, desk, session, where
from fake_session import FakeSession
from imgui_bundle import imgui

from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.ui import layout
from app.ui.app import Ui
from app.viewer.ui_frame import ui_image

__all__ = ["desk", "session", "where"]


@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080), (2560, 1440)], ids=str)
def test_panels_stand_side_by_side(gpu: Gpu, size: tuple[int, int]) -> None:
    desk = Desk(gpu, FakeSession(), size)
    taken = np.zeros((size[1], size[0]), int)
    windows = {panel.title: imgui.internal.find_window_by_name(panel.title) for panel in layout.PANELS}
    tabs = {"Compare": "Inspect", "Bake": "Inspect", "Lights": "Solver", "Materials": "Solver", "Scene": "Solver"}
    docks = {window.dock_id: window for title, window in windows.items() if title not in tabs}
    for title, other in tabs.items():
        assert windows[title].dock_id == windows[other].dock_id, "a tab behind the other"
        assert windows[title].hidden and not windows[other].hidden
    for window in docks.values():
        assert window.dock_id and window.size.x >= 280 and window.size.y >= 150, window.name
        left, top = int(window.pos.x), int(window.pos.y)
        taken[top : top + int(window.size.y), left : left + int(window.size.x)] += 1
    left, top, width, height = (int(v) for v in desk.ui.state.view_px)
    taken[top : top + height, left : left + width] += 1
    assert taken.max() == 1  # nothing overlaps
    assert (taken == 1).mean() > 0.9  # the rest is bars and separators
    assert width * height > 0.3 * size[0] * size[1]
    desk.release()


FIRST = ("texels", "density", "tile", "adaptive", "depth", "gradient", "Pause", "step", "Restart", "anew")


@pytest.mark.parametrize(("size", "scale"), [((1280, 720), 1.0), ((900, 600), 1.0), ((2560, 1440), 2.0)], ids=str)
@pytest.mark.parametrize("adaptive", [False, True])
def test_what_a_newcomer_needs_is_in_sight(
    gpu: Gpu, where: dict[str, tuple[float, float]], size: tuple[int, int], scale: float, adaptive: bool
) -> None:
    """Solver, quadtree and density, without scrolling; and the names of all tabs."""
    session = FakeSession()
    session.light, session.atlas = LightmapOptions(adaptive=adaptive), AtlasOptions(texels=8000, density=40.0)
    desk = Desk(gpu, session, size, ui=Ui(scale=scale, native_dialog=False))
    desk.frames(3)
    panel = imgui.internal.find_window_by_name("Solver")
    assert panel.scroll.y == 0
    for name in FIRST:
        x, y = where[name]
        assert panel.pos.x < x < panel.pos.x + panel.size.x, name
        assert panel.pos.y < y < panel.pos.y + panel.size.y - 8 * scale, name
    tabs = imgui.internal.dock_builder_get_node(panel.dock_id).tab_bar
    assert tabs.width_all_tabs <= tabs.bar_rect.max.x - tabs.bar_rect.min.x
    desk.release()


def test_a_layout_of_other_panels_is_built_anew(gpu: Gpu, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "layout.ini"
    with monkeypatch.context() as before:
        before.setattr(layout, "PANELS", tuple(panel for panel in layout.PANELS if panel.title != "Lights"))
        Desk(gpu, FakeSession(), ui=Ui(layout_file=file)).release()
    desk = Desk(gpu, FakeSession(), ui=Ui(layout_file=file))
    lights, solver = (imgui.internal.find_window_by_name(title) for title in ("Lights", "Solver"))
    assert lights.dock_id == solver.dock_id != 0
    desk.release()


def test_a_window_that_becomes_narrow_or_wide_again_has_all_panels_docked_beside_the_view(
    gpu: Gpu, tmp_path: Path
) -> None:
    file, titles = tmp_path / "layout.ini", {panel.title for panel in layout.PANELS}
    wide = Desk(gpu, FakeSession(), (1280, 720), ui=Ui(layout_file=file))
    for size in ((900, 600), (1280, 720)):
        wide.size = size
        wide.frames(3)
        assert wide.ui.state.docked == titles
    wide.release()
    narrow = Desk(gpu, FakeSession(), (900, 600), ui=Ui(layout_file=file))
    assert narrow.ui.state.docked == titles
    assert narrow.ui.state.view_px[2] > 0.5 * 900
    narrow.release()


def test_the_layout_is_kept_and_can_be_reset(gpu: Gpu, tmp_path: Path) -> None:
    places = []
    for change in ("drag a separator", "", "reset"):
        ui = Ui(layout_file=tmp_path / "layout.ini")
        desk = Desk(gpu, FakeSession(), ui=ui)
        if change == "reset":
            ui.state.rebuild_layout = True
            desk.frames(3)
        places.append(ui.state.view_px)
        if change == "drag a separator":
            left, top, _, height = ui.state.view_px
            desk.drag((left - 1, top + height / 2), (left + 49, top + height / 2))
            desk.frames(2)
            places.append(ui.state.view_px)
        desk.release()
    first, dragged, again, reset = places
    assert dragged[0] == pytest.approx(first[0] + 50, abs=2)  # where in the separator it was taken
    assert again == dragged
    assert reset == first


@pytest.mark.parametrize("size", [(320, 240), (640, 480)], ids=str)
def test_a_small_window_still_works(gpu: Gpu, size: tuple[int, int]) -> None:
    desk = Desk(gpu, FakeSession(), size)
    left, bottom, width, height = desk.ui.view_rect
    assert left >= 0 and bottom >= 0 and width >= 1 and height >= 1
    desk.release()


def test_hidden_interface_leaves_the_view_alone(desk: Desk) -> None:
    desk.key(imgui.Key.f2)
    assert desk.ui.view_rect == (0, 0, *SIZE)
    assert (
        np.abs(desk.image().astype(int) - np.array([51, 76, 102])).max() <= 1
    )  # the fake session's colour, everywhere


def test_the_view_is_drawn_in_its_place(desk: Desk) -> None:
    image = desk.image()
    left, bottom, width, height = desk.ui.view_rect
    top = SIZE[1] - bottom - height
    inside = image[top : top + height, left : left + width]
    assert np.abs(inside.astype(int) - np.array([51, 76, 102])).max() <= 1
    assert (np.abs(image[:, : left - 4].astype(int) - np.array([51, 76, 102])).max(axis=-1) > 1).all()


def test_pictures_of_the_same_state_are_the_same(gpu: Gpu) -> None:
    first, second = (ui_image(FakeSession(gpu=gpu), (640, 400), measured=False) for _ in range(2))
    assert first.shape == (400, 640, 3)
    assert (first == second).all()
    assert first.std() > 10


@pytest.mark.parametrize("size", [(0, 100), (100, 10**6)], ids=str)
def test_a_picture_of_a_size_that_cannot_be(gpu: Gpu, size: tuple[int, int]) -> None:
    with pytest.raises(UserError, match=f"{size[0]}×{size[1]}"):
        ui_image(FakeSession(gpu=gpu), size)


def test_text_is_as_large_as_the_user_wants_it(gpu: Gpu, tmp_path: Path) -> None:
    """By keys and at once; panels follow."""
    desk = Desk(gpu, FakeSession(), (1920, 1080), ui=Ui(layout_file=tmp_path / "layout.ini"))
    sizes, state = [], desk.ui.state

    def look() -> None:
        desk.frames(3)
        sizes.append((imgui.get_style().font_scale_dpi, state.view_px[0]))

    look()
    for key in (imgui.Key.equal, imgui.Key.keypad_add, imgui.Key._0):
        desk.key(key, control=True)
        look()
    first, larger, largest, again = sizes
    assert again == first
    for small, large in ((first, larger), (larger, largest)):
        assert all(a < b for a, b in zip(small, large, strict=True))
    assert largest[1] / first[1] == pytest.approx(largest[0] / first[0], rel=0.04)  # text is whole pixels high
    desk.key(imgui.Key.minus, control=True)
    assert state.text_size == 0.9 and state.docked == {panel.title for panel in layout.PANELS}
    desk.release()
