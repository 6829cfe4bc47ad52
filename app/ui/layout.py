"""Where the panels stand: docks around the 3-D view, which is the central node that lets the picture through."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.ui import theme, widgets
from app.ui.panels import compare, convergence, display, inspect, lights, materials, scene, solver
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

SIDE_EM = 20.5  # width of the side docks, in font heights: the widest fact fits
BOTTOM_SHARE = 0.27  # height of the lower dock, of the window
DISPLAY_EM = 18.5  # height that the upper panel needs; what is below it gets the rest
HIGHEST_UPPER = 0.54  # of a low window for it
WIDEST_SIDES = 0.3  # of a narrow window for each side dock


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
    Panel("Convergence", "bottom", convergence.draw),
)


def docks(state: State) -> None:
    """The dock space over what menu and status bar leave; the first time, on request, and where a layout that was kept knows
    other panels, the docks are built."""
    space = imgui.get_id(f"docks of {', '.join(panel.title for panel in PANELS)}")
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
                widgets.dim("no scene")
        imgui.end()


def _build(space: int) -> None:
    build = imgui.internal
    window = imgui.get_main_viewport().size
    # the viewport's work area knows of menu and status bar only a frame later
    area = imgui.ImVec2(window.x, max(window.y - 2 * imgui.get_frame_height(), 1.0))
    build.dock_builder_remove_node(space)
    build.dock_builder_add_node(space, imgui.internal.DockNodeFlagsPrivate_.dock_space)
    build.dock_builder_set_node_size(space, area)
    side = min(SIDE_EM * imgui.get_font_size() / max(area.x, 1.0), WIDEST_SIDES)
    _, left, rest = build.dock_builder_split_node_py(space, imgui.Dir.left, side)
    _, right, rest = build.dock_builder_split_node_py(rest, imgui.Dir.right, side / (1 - side))
    _, bottom, _ = build.dock_builder_split_node_py(rest, imgui.Dir.down, BOTTOM_SHARE)
    upper = min(DISPLAY_EM * imgui.get_font_size() / area.y, HIGHEST_UPPER)
    _, right_top, right = build.dock_builder_split_node_py(right, imgui.Dir.up, upper)
    nodes = {"left": left, "right": right, "right top": right_top, "bottom": bottom}
    for panel in PANELS:
        build.dock_builder_dock_window(panel.title, nodes[panel.dock])
        build.dock_builder_get_node(nodes[panel.dock]).set_local_flags(build.DockNodeFlagsPrivate_.no_close_button)
    build.dock_builder_finish(space)
