"""Solver: run, pause, one shot, restart; how fast; the knobs; and the energy book."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.options import specs
from app.solvers import TREE
from app.ui import theme, widgets
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.session import Session

ICONS = theme.ICONS
BAR_EM = 0.5  # height of the bars


def draw(session: Session, state: State) -> None:
    """The whole panel."""
    assert state.stats is not None
    _buttons(session, state, done=state.stats.converged)
    _progress(state)
    edited = session.shooting
    if session.atlas.adaptive:
        widgets.section("Quadtree")
        _leaves(session, state)
        edited = widgets.edit_options(edited, skip=(spec.name for spec in specs(type(edited)) if spec.name not in TREE))
    widgets.section("Pace")
    state.pace = widgets.edit_options(state.pace)
    widgets.section("Energy [W]")
    _energy(state)
    widgets.section("Shooting")
    assert state.stats is not None
    edited = widgets.edit_options(
        edited, skip=TREE, starts={"level": state.stats.level, "resolution": state.stats.resolution}
    )
    if edited is not session.shooting:
        state.act(lambda: session.set_shooting(edited))


def _leaves(session: Session, state: State) -> None:
    """How many leaves there are, and what they spare."""
    stats = state.stats
    assert stats is not None
    share = stats.texels / max(stats.uniform_texels, 1)
    imgui.text_unformatted(f"{stats.tiles:,} leaves, {stats.texels:,} texels")
    imgui.same_line()
    right(widgets.percent(share), theme.DIM)
    widgets.tooltip(f"Of the {stats.uniform_texels:,} texels that the finest level everywhere would take")
    if not session.solver.grown:
        widgets.dim("leaves are changing")
    elif session.solver.note is not None:
        widgets.wrapped(session.solver.note, theme.AMBER)


def _buttons(session: Session, state: State, *, done: bool) -> None:
    spacing = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - 2 * spacing) / 3
    size = imgui.ImVec2(width, 0)
    text = f"{ICONS.ICON_FA_PAUSE} Pause" if session.running else f"{ICONS.ICON_FA_PLAY} Run"
    imgui.begin_disabled(done)
    if imgui.button("Converged###run" if done else f"{text}###run", size):
        toggle(session)
    imgui.end_disabled()
    widgets.tooltip("As little is left to shoot as Residual asks for, below" if done else "Space")
    imgui.same_line()
    if imgui.button("One shot", size):
        session.running = False
        state.act(session.shoot)
    widgets.tooltip("Pause and shoot once: . (full stop)")
    imgui.same_line()
    if imgui.button(f"{ICONS.ICON_FA_ROTATE_LEFT} Restart", size):
        state.act(session.restart)
    widgets.tooltip("Forget all light and begin again: R")


def toggle(session: Session) -> None:
    """Run or pause."""
    session.running = not session.running


def _progress(state: State) -> None:
    stats = state.stats
    assert stats is not None
    share = min(max(0.0, 1.0 - stats.residual), 1.0)  # 0 where the residual is no number
    imgui.progress_bar(share, imgui.ImVec2(-1, imgui.get_font_size() * BAR_EM), "")
    widgets.tooltip("Power that has been shot, of the power emitted")
    left = widgets.percent(stats.residual)
    imgui.text_unformatted(f"converged, {left} unshot" if stats.converged else f"{left} still to shoot")
    rate = f", {widgets.number(stats.shots_per_second, 3)}/s" if state.measured and not stats.converged else ""
    imgui.same_line()
    right(f"{stats.shots:,} shots{rate}", theme.DIM)
    if stats.edit_shots is not None:
        fresh = "" if stats.fresh_shots is None else f", from nothing {stats.fresh_shots:,}"
        widgets.dim(f"the edit: {stats.edit_shots:,} shots{fresh}")
        widgets.tooltip("Only the difference that an edit makes is shot, negative where light goes")


def _energy(state: State) -> None:
    stats = state.stats
    assert stats is not None
    rows = [
        ("Emitted", stats.emitted, theme.TEXT),
        ("Absorbed", stats.absorbed, theme.ABSORBED),
        ("Escaped", stats.escaped, theme.ESCAPED),
        ("Residual", stats.unshot, theme.UNSHOT),
    ]
    _bar([(power, colour) for _, power, colour in rows[1:]], stats.emitted)
    if imgui.begin_table("energy", 3, imgui.TableFlags_.sizing_stretch_prop):
        for label, power, colour in rows:
            imgui.table_next_row()
            imgui.table_next_column()
            imgui.text_colored(imgui.ImVec4(*colour), label)
            imgui.table_next_column()
            right(widgets.number(power))
            imgui.table_next_column()
            right(widgets.percent(power / stats.emitted if stats.emitted > 0 else 0.0))
        imgui.end_table()
    widgets.dim(f"books off by {widgets.percent(abs(stats.imbalance))}")
    widgets.tooltip("Emitted must equal absorbed + escaped + residual; the difference, of the power emitted")


def right(text: str, colour: theme.RGBA = theme.TEXT) -> None:
    """Text that ends at the right edge of its column."""
    imgui.set_cursor_pos_x(
        imgui.get_cursor_pos_x() + max(0.0, imgui.get_content_region_avail().x - imgui.calc_text_size(text).x)
    )
    imgui.text_colored(imgui.ImVec4(*colour), text)


def _bar(shares: list[tuple[float, theme.RGBA]], total: float) -> None:
    """Where the emitted power is now, as one bar."""
    width, height = imgui.get_content_region_avail().x, imgui.get_font_size() * BAR_EM
    corner = imgui.get_cursor_screen_pos()
    left = corner.x
    for power, colour in shares:
        right = min(left + width * max(0.0, power) / total, corner.x + width) if total > 0 else left
        box = imgui.ImVec2(left, corner.y), imgui.ImVec2(right, corner.y + height)
        imgui.get_window_draw_list().add_rect_filled(*box, theme.colour_u32(colour))
        left = right
    imgui.dummy(imgui.ImVec2(width, height))
