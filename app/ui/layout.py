"""Where the panels stand: docks around the 3-D view, which is the central node that lets the picture through."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.ui import theme, widgets
from app.ui.panels import bake, compare, convergence, display, inspect, lights, materials, scene, solver
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

SIDE_EM = 20.5  # width of the side docks, in font heights: the widest fact fits
BOTTOM_SHARE, BOTTOM_EM = 0.27, 12.0  # height of the lower dock, of the window, and at least
LOWEST_SHARE = 0.4  # of a very low window
DISPLAY_EM = 18.5  # height that the upper panel needs; what is below it gets the rest
HIGHEST_UPPER = 0.54  # of a low window for it
NARROW_EM = 72.0  # width of a window, below which one column holds all panels, one group above the other
WIDEST_SIDE = 0.4  # of a very narrow window for it
ABOVE_SHARE = 0.68  # height of the upper group, in which the solver is
OPENING = "opening"


@dataclass(frozen=True)
class Panel:
    """A docked window: its title, its dock and what draws its inside."""

    title: str
    dock: str
    draw: Callable[[View, State], None]


PANELS = (
    Panel("Solver", "left", solver.draw),
    Panel("Lights", "left", lights.draw),
    Panel("Materials", "left", materials.draw),
    Panel("Scene", "left", scene.draw),
    Panel("Display", "right top", display.draw),
    Panel("Inspect", "right", inspect.draw),
    Panel("Compare", "right", compare.draw),
    Panel("Bake", "right", bake.draw),
    Panel("Convergence", "bottom", convergence.draw),
)


def docks(state: State) -> None:
    """The dock space over what menu and status bar leave; the first time, on request, where a layout that was kept knows other
    panels, and where the window has become narrow or wide, the docks are built."""
    space = _space(narrow=_narrow())
    if state.rebuild_layout or imgui.internal.dock_builder_get_node(space) is None:
        _build(space)
        state.rebuild_layout = False
    with theme.see_through():
        imgui.dock_space_over_viewport(space, None, imgui.DockNodeFlags_.passthru_central_node)
    node = imgui.internal.dock_builder_get_central_node(space)
    state.view_px = (node.pos.x, node.pos.y, max(node.size.x, 1.0), max(node.size.y, 1.0))


def panels(view: View, state: State) -> None:
    """Every panel that is not hidden. A reference that has come brings its panel to the front."""
    compared = view.session.opened and view.session.compared.comparison is not None
    if compared and not state.compared:
        imgui.set_window_focus("Compare")
    state.compared = compared
    for panel in PANELS:
        if panel.title in state.hidden_panels:
            continue
        with theme.see_through(panel.title in state.docked):
            visible, _ = imgui.begin(panel.title, None, imgui.WindowFlags_.no_collapse)
        (state.docked.add if imgui.is_window_docked() else state.docked.discard)(panel.title)
        if visible:
            if view.session.opened:
                panel.draw(view, state)
            else:
                widgets.dim("no scene" if view.session.on_its_way is None else OPENING)
        imgui.end()


def _narrow() -> bool:
    """Whether the window has no room for panels on both sides of the view."""
    return imgui.get_main_viewport().size.x < NARROW_EM * imgui.get_font_size()


def _space(*, narrow: bool) -> int:
    """The dock space of a narrow or a wide window."""
    return imgui.get_id(f"{'column' if narrow else 'sides'} of {', '.join(panel.title for panel in PANELS)}")


def _build(space: int) -> None:
    build, narrow = imgui.internal, _narrow()
    window = imgui.get_main_viewport().size
    # the viewport's work area knows of menu and status bar only a frame later
    area = imgui.ImVec2(window.x, max(window.y - 2 * imgui.get_frame_height(), 1.0))
    for either in (False, True):  # panels stand in one of the two
        build.dock_builder_remove_node(_space(narrow=either))
    build.dock_builder_add_node(space, imgui.internal.DockNodeFlagsPrivate_.dock_space)
    build.dock_builder_set_node_size(space, area)
    nodes = _column(space, area) if narrow else _both_sides(space, area)
    for panel in PANELS:
        build.dock_builder_dock_window(panel.title, nodes[panel.dock])
        build.dock_builder_get_node(nodes[panel.dock]).set_local_flags(build.DockNodeFlagsPrivate_.no_close_button)
    build.dock_builder_finish(space)


def _bottom_share(area: imgui.ImVec2) -> float:
    """The share of the height that the plots take."""
    return max(BOTTOM_SHARE, min(BOTTOM_EM * imgui.get_font_size() / area.y, LOWEST_SHARE))


def _both_sides(space: int, area: imgui.ImVec2) -> dict[str, int]:
    """The docks of a window that has room for them left and right of the view."""
    split = imgui.internal.dock_builder_split_node_py
    side = SIDE_EM * imgui.get_font_size() / max(area.x, 1.0)
    _, left, rest = split(space, imgui.Dir.left, side)
    _, right, rest = split(rest, imgui.Dir.right, side / (1 - side))
    _, bottom, _ = split(rest, imgui.Dir.down, _bottom_share(area))
    upper = min(DISPLAY_EM * imgui.get_font_size() / area.y, HIGHEST_UPPER)
    _, right_top, right = split(right, imgui.Dir.up, upper)
    return {"left": left, "right": right, "right top": right_top, "bottom": bottom}


def _column(space: int, area: imgui.ImVec2) -> dict[str, int]:
    """The docks of a narrow window: the view has most of its width."""
    split = imgui.internal.dock_builder_split_node_py
    side = min(SIDE_EM * imgui.get_font_size() / max(area.x, 1.0), WIDEST_SIDE)
    _, left, rest = split(space, imgui.Dir.left, side)
    _, bottom, _ = split(rest, imgui.Dir.down, _bottom_share(area))
    _, above, below = split(left, imgui.Dir.up, ABOVE_SHARE)
    return {"left": above, "right": below, "right top": below, "bottom": bottom}
