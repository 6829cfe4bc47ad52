"""Solver: which one; run, pause, one step, restart; at which pace; its options; and the energy balance."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.solvers import SOLVERS
from app.ui import new_lamps, theme, widgets
from app.ui.panels import detail, energy
from app.ui.state import State
from app.ui.words import plain, title

if TYPE_CHECKING:
    from app.session.view import View

ICONS = theme.ICONS
BAR_EM = 0.5  # height of the bars
EVENING = (
    "Large patches have shot their mean. What their parts have above and below it is shot by finer patches now, more light here "
    "and less there: shadows become true, while the sum of unshot light stands about still until all is even"
)


def draw(view: View, state: State) -> None:
    """The whole panel."""
    session, stats = view.session, state.stats
    assert stats is not None
    _choice(view, state)
    lit = new_lamps.is_lit(view, state)
    _buttons(view, state, done=stats.converged, lit=lit)
    _progress(view, state, lit=lit)
    _figures(state)
    detail.draw(view, state)
    state.pace = widgets.edit_options(state.pace)
    energy.draw(view, state)
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


def _buttons(view: View, state: State, *, done: bool, lit: bool) -> None:
    session = view.session
    spacing = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - 2 * spacing) / 3
    size = imgui.ImVec2(width, 0)
    text = f"{ICONS.ICON_FA_PAUSE} Pause" if session.run.running else f"{ICONS.ICON_FA_PLAY} Run"
    imgui.begin_disabled(done or not lit)
    if imgui.button(f"{'No light' if not lit else 'Converged' if done else text}###run", size):
        toggle(view)
    imgui.end_disabled()
    over = f"As little remains as {title(session.family.threshold)} asks for, below" if done else "Space"
    widgets.tooltip(over if lit else new_lamps.DARK)
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


def _progress(view: View, state: State, *, lit: bool) -> None:
    """How far it is; of a scene that nothing lights, what to do."""
    stats = state.stats
    assert stats is not None
    if not lit:
        _dark()
        return
    imgui.progress_bar(stats.progress, imgui.ImVec2(-1, imgui.get_font_size() * BAR_EM), "")
    left = f"{widgets.percent(stats.remaining)} {stats.remains}"
    least = widgets.percent(float(getattr(view.session.options, view.session.family.threshold)))
    widgets.tooltip(f"How far it is on the way, in powers of ten, down to the {least} {stats.remains} that may remain")
    imgui.text_unformatted(f"converged, {left}" if stats.converged else left)
    rate = f", {widgets.number(stats.per_second, 3)}/s" if state.measured and not stats.converged else ""
    imgui.same_line()
    widgets.right(f"{view.session.family.words(stats.done)}{rate}", theme.DIM)
    if stats.note is not None and not view.session.light.adaptive:
        widgets.one_line(plain(stats.note), theme.AMBER)
    elif stats.edit_work is not None:
        fresh = "" if stats.fresh_work is None else f", from nothing {stats.fresh_work:,}"
        widgets.one_line(f"the edit: {view.session.family.words(stats.edit_work)}{fresh}", theme.DIM)
        widgets.tooltip("Only the difference that an edit makes is solved for, negative where light goes")
    elif stats.doing and not view.session.light.adaptive:
        widgets.one_line(stats.doing, theme.DIM)
        widgets.tooltip(EVENING)
    else:
        imgui.text_unformatted("")  # as high as with something to say


def _dark() -> None:
    """Nothing is under way, and a button leads to where lamps are added; as high as ``_progress``."""
    imgui.progress_bar(0.0, imgui.ImVec2(-1, imgui.get_font_size() * BAR_EM), "")
    imgui.text_colored(imgui.ImVec4(*theme.AMBER), new_lamps.DARK)
    imgui.same_line()
    if imgui.small_button("Add a lamp###to lamps"):
        imgui.set_window_focus("Lights")
    widgets.tooltip("Shows the Lights panel, which has a button for each kind of lamp")
    imgui.text_unformatted("")


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
