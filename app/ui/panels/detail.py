"""Detail, a section of the Solver panel: how finely surfaces are cut into texels, and where quadtrees refine them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.ui import theme, widgets
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

CUT = ("texels", "density", "tile")  # in the order that a newcomer needs them
FIRST = ("depth", "gradient")  # of a quadtree's options: always in sight
MORE = ("criterion", "shadow", "budget", "storage")
STOP = (
    "Leave the leaves as they are; new ones still get the light of earlier shots. Pressed again, they keep what they have from "
    "the leaves before them"
)


def draw(view: View, state: State) -> None:
    """The whole section."""
    widgets.section("Detail")
    _cut(view, state)
    if view.session.light.adaptive:
        _leaves(view, state)
    _quadtree(view, state)


def _cut(view: View, state: State) -> None:
    """How surfaces are cut; takes hold with the button, since light begins again then. The draft stays until that."""
    session, stats = view.session, state.stats
    assert stats is not None
    atlas = session.atlas if state.atlas is None else state.atlas
    light = session.light if state.adaptive is None else session.light.replace(adaptive=state.adaptive)
    starts = {"density": float(session.charts.density), "texels": stats.texels}
    state.atlas = atlas = widgets.edit_options(atlas, only=CUT, starts=starts)
    light = widgets.edit_options(light, only=("adaptive",))
    state.adaptive = light.adaptive
    same, busy = (atlas, light) == (session.atlas, session.light), session.loading is not None
    imgui.begin_disabled(same or busy)
    imgui.push_style_color(imgui.Col_.text, imgui.ImVec4(*(theme.TEXT if same else theme.AMBER)))
    if imgui.button("Cut anew", imgui.ImVec2(-1, 0)):
        state.act(lambda: session.cut_anew(atlas, adaptive=light.adaptive))
    imgui.pop_style_color()
    imgui.end_disabled()
    reason = "\nNo effect now: surfaces are cut like that" if same else "\nNot now: a scene is loading" if busy else ""
    widgets.tooltip(
        f"Cut all surfaces into texels as it says above, in the background; then light begins again{reason}"
    )


def _quadtree(view: View, state: State) -> None:
    """Where quadtrees refine texels; this can be set before surfaces are cut into quadtrees, too, once Adaptive is ticked."""
    session = view.session
    adaptive = session.light.adaptive
    light = edited = session.light.replace(adaptive=adaptive or bool(state.adaptive))
    edited = widgets.edit_options(edited, only=FIRST)
    if imgui.tree_node("More###more detail"):
        edited = widgets.edit_options(edited, only=MORE)
        imgui.tree_pop()
    if edited is not light:
        state.act(lambda: session.set_light(edited.replace(adaptive=adaptive)))


def _leaves(view: View, state: State) -> None:
    """How many leaves there are, what they spare, and what is being done for them; as high whether something is or not."""
    stats = state.stats
    assert stats is not None
    share = stats.texels / max(stats.uniform_texels, 1)
    imgui.text_unformatted(f"{stats.tiles:,} leaves, {stats.texels:,} texels")
    imgui.same_line()
    widgets.right(widgets.percent(share), theme.DIM)
    widgets.tooltip(f"Of the {stats.uniform_texels:,} texels that the finest level everywhere would take")
    if not stats.refining:
        widgets.one_line(stats.note or "", theme.AMBER)
        return
    widgets.dim(stats.leaves)
    imgui.same_line()
    style, width = imgui.get_style(), imgui.calc_text_size("Stop").x
    left = imgui.get_content_region_avail().x - width - 2 * style.frame_padding.x
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + max(left, 0.0))
    if imgui.small_button("Stop###stop leaves"):
        state.act(view.session.hold_leaves)
    widgets.tooltip(STOP)
