"""Solver: which one; run, pause, one step, restart; at which pace; its options; and the energy balance."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.render.units import QUANTITIES, measure
from app.session.run import Stop
from app.solvers import SOLVERS
from app.ui import theme, widgets
from app.ui.panels import detail
from app.ui.state import State

if TYPE_CHECKING:
    from app.scene.model import F64
    from app.session.view import View

ICONS = theme.ICONS
BAR_EM = 0.5  # height of the bars
NEVER = Stop()


def draw(view: View, state: State) -> None:
    """The whole panel."""
    session, stats = view.session, state.stats
    assert stats is not None
    _choice(view, state)
    _buttons(view, state, done=stats.converged)
    state.pace = widgets.edit_options(state.pace)
    _progress(view, state)
    _figures(state)
    detail.draw(view, state)
    widgets.section(f"Energy [{QUANTITIES[view.display.quantities]['flows'].unit}]")
    _energy(view, state)
    widgets.section(session.family.title)
    options = widgets.edit_options(session.options, starts=stats.resolved)
    if options is not session.options:
        state.act(lambda: session.set_options(options))


def _choice(view: View, state: State) -> None:
    """Which solver it is; another one can be chosen while it runs."""
    names = list(SOLVERS)
    widgets.labelled("Solver")
    now = names.index(view.session.chosen_solver)
    imgui.set_next_item_width(-1)
    changed, chosen = imgui.combo("##solver", now, [SOLVERS[name].title for name in names])
    widgets.tooltip(SOLVERS[names[now]].help)
    if changed and chosen != now:
        state.act(lambda: view.session.set_solver(names[chosen]))


def _buttons(view: View, state: State, *, done: bool) -> None:
    session = view.session
    spacing = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - 2 * spacing) / 3
    size = imgui.ImVec2(width, 0)
    text = f"{ICONS.ICON_FA_PAUSE} Pause" if session.run.running else f"{ICONS.ICON_FA_PLAY} Run"
    imgui.begin_disabled(done)
    if imgui.button("Converged###run" if done else f"{text}###run", size):
        toggle(view)
    imgui.end_disabled()
    widgets.tooltip(
        f"As little remains as {widgets.title(session.family.threshold)} asks for, below" if done else "Space"
    )
    imgui.same_line()
    if imgui.button("One step", size):
        session.run.running = False
        state.act(session.work)
    widgets.tooltip(f"Pause and make one of the {session.family.unit}: . (full stop)")
    imgui.same_line()
    if imgui.button(f"{ICONS.ICON_FA_ROTATE_LEFT} Restart", size):
        state.act(session.restart)
    widgets.tooltip("Forget all light and begin again: R")


def toggle(view: View) -> None:
    """Run or pause."""
    view.session.run.running = not view.session.run.running


def _progress(view: View, state: State) -> None:
    stats, run = state.stats, view.session.run
    assert stats is not None
    done = 1.0 - stats.remaining if run.family.distributes else run.share_done(NEVER)
    share = min(max(0.0, done), 1.0)  # 0 where it is no number
    imgui.progress_bar(share, imgui.ImVec2(-1, imgui.get_font_size() * BAR_EM), "")
    left = f"{widgets.percent(stats.remaining)} {stats.remains}"
    widgets.tooltip(f"What is done; {left}")
    imgui.text_unformatted(f"converged, {left}" if stats.converged else left)
    rate = f", {widgets.number(stats.per_second, 3)}/s" if state.measured and not stats.converged else ""
    imgui.same_line()
    widgets.right(f"{stats.done:,} {stats.unit}{rate}", theme.DIM)
    if stats.note is not None and not stats.refining:
        widgets.wrapped(stats.note, theme.AMBER)
    if stats.edit_work is not None:
        fresh = "" if stats.fresh_work is None else f", from nothing {stats.fresh_work:,}"
        widgets.dim(f"the edit: {stats.edit_work:,} {stats.unit}{fresh}")
        widgets.tooltip("Only the difference that an edit makes is solved for, negative where light goes")


def _figures(state: State) -> None:
    """What the solver counts and says of its solution."""
    stats = state.stats
    assert stats is not None
    rows = list(stats.figures.items())
    for name, count in stats.counts.items():
        fast = count / stats.done * stats.per_second if state.measured and stats.done else 0.0
        rate = f", {widgets.number(fast, 3)}/s" if fast > 0 else ""
        edit = f"\n{stats.counts_in_edit[name]:,} since the edit" if name in stats.counts_in_edit else ""
        rows.append((name, f"{count:,}{rate}{edit}"))
    widgets.facts("figures", rows)


def _energy(view: View, state: State) -> None:
    stats, balance, unshot = state.stats, view.session.run.energy, view.session.family.distributes
    assert stats is not None
    rows = [
        ("Emitted", stats.emitted, balance.emitted, theme.TEXT),
        ("Absorbed", stats.absorbed, balance.absorbed, theme.ABSORBED),
        ("Escaped", stats.escaped, balance.escaped, theme.ESCAPED),
        *([("Residual", stats.unshot, balance.unshot, theme.UNSHOT)] if unshot else []),
    ]
    _bar([(power, colour) for _, power, _, colour in rows[1:]], stats.emitted)
    if imgui.begin_table("energy", 3, imgui.TableFlags_.sizing_stretch_prop):
        for label, power, light, colour in rows:
            imgui.table_next_row()
            imgui.table_next_column()
            imgui.text_colored(imgui.ImVec4(*colour), label)
            imgui.table_next_column()
            widgets.right(widgets.number(_flux(light, view)))
            imgui.table_next_column()
            widgets.right(widgets.percent(power / stats.emitted if stats.emitted > 0 else 0.0))
        imgui.end_table()
    widgets.dim(f"energy imbalance {widgets.percent(abs(stats.imbalance))}")
    parts = "absorbed + escaped + residual" if unshot else "absorbed + escaped"
    widgets.tooltip(f"Emitted must equal {parts}; the difference, of the power emitted")


def _flux(power: F64, view: View) -> float:
    """Of power (3,) [W], in what light is counted in: watts of all channels, or lumen."""
    radiometric = view.display.quantities == "radiometric"
    return float(power.sum()) if radiometric else measure(power.tolist(), "photometric")


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
