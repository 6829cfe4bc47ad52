"""Bake: the light that one sees, with the scene as it was edited, as files for games and the web."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.session.baking import JUDGING, SOLVING, Baking, Order, why_not
from app.session.checkpoint import CHECKPOINT_NAME
from app.session.goal import seconds_left
from app.session.report import look_of
from app.ui import theme, widgets, words
from app.ui.state import State
from app.util.desktop import show_folder

if TYPE_CHECKING:
    from app.session.stats import Stats
    from app.session.view import View

ICONS = theme.ICONS
CUT = ("texels", "density")
GO_ON = "A bake into this folder was not finished: with its settings, from where it was"
STOP = "Stop solving. The light stays as it is, here and in the folder's checkpoint"
WRITE = "Write the light as it is now; the checkpoint stays, so that it can go on"


def draw(view: View, state: State) -> None:
    """The whole panel."""
    if state.order is None:
        state.order = Order(first_folder(view))
    if state.baking is not None and state.baking.active:
        _under_way(view, state, state.baking)
        return
    if state.baking is not None:
        _last(state, state.baking)
    state.order = replace(state.order, folder=_folder(state, state.order.folder))
    _begin(view, state)
    _estimate(view, state)
    _light(view, state)
    if widgets.fold("Files", opened=False):
        files = widgets.edit_options(state.order.files, skip=() if state.order.files.web else ("three",))
        state.order = replace(state.order, files=files, keep=widgets.edit_options(state.order.keep))


def follow(state: State, baking: Baking) -> None:
    """Once per frame: let the bake go on, and say when it is over."""
    under_way = baking.active
    baking.poll()
    if not under_way or baking.active:
        return
    if baking.baked is not None:
        state.notify(f"baked: {baking.order.folder}")
    elif baking.note is not None:
        state.notify(f"no bake: {baking.note}", error=True)


def roughly(seconds: float) -> str:
    """In one unit: what is foreseen is not known to the second."""
    if seconds < 90:
        return f"{max(seconds, 1):.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def first_folder(view: View) -> Path:
    """Beside whoever started the program, named after the scene."""
    name = "".join(c if c.isalnum() or c in "-_. " else "-" for c in view.session.name).strip() or "scene"
    return Path.cwd() / f"{name} baked"


def _light(view: View, state: State) -> None:
    """What is asked of the light."""
    session, order, stats = view.session, state.order, state.stats
    assert order is not None and stats is not None
    widgets.section(session.family.title)
    atlas = session.atlas if state.atlas is None else state.atlas
    starts = {"density": float(session.charts.density), "texels": stats.texels}
    state.atlas = widgets.edit_options(atlas, only=CUT, starts=starts)
    options = widgets.edit_options(session.options, only=(session.family.threshold,))
    if options is not session.options:
        state.act(lambda: session.set_options(options))
    state.order = replace(order, goal=widgets.edit_options(order.goal, starts={"error": 1.0}))


def _folder(state: State, folder: Path) -> Path:
    """Where the files go: typed, or chosen."""
    button = 1.4 * imgui.get_frame_height()
    imgui.set_next_item_width(-button - imgui.get_style().item_spacing.x)
    changed, text = imgui.input_text("##folder", str(folder))
    widgets.tooltip(f"{folder}\nThe folder to write; it is made if need be")
    imgui.same_line()
    if imgui.button(f"{ICONS.ICON_FA_FOLDER_OPEN}###choose", imgui.ImVec2(button, 0)):
        state.ask_for_folder = True
    widgets.tooltip("Choose a folder")
    return Path(text).expanduser() if changed and text.strip() else folder


def _estimate(view: View, state: State) -> None:
    """What it will take, as far as the solve so far says that."""
    session, stats = view.session, state.stats
    assert stats is not None and state.order is not None
    wanted = state.atlas.texels if state.atlas is not None and state.atlas.density is None else None
    density = None if state.atlas is None else state.atlas.density
    times = (wanted or stats.texels) / max(stats.texels, 1)
    if density is not None:
        times = (density / session.charts.density) ** 2
    rows = [("Texels", f"{'about ' if times != 1 else ''}{stats.texels * times:,.0f}")]
    memory = f"about {max(stats.memory_mib * times, 1.0):,.0f} MiB"
    if hasattr(session.options, "ray_memory"):
        memory += f", rays up to {session.options.ray_memory:,} MiB"
    rows.append(("Memory", memory))
    if state.measured and session.edited_scene.emits:
        rows.append(("Time", _time(view, stats, times)))
    widgets.facts("estimate", rows)
    widgets.tooltip("Estimates: of texels as the surfaces' area has it, of time from the solve so far")
    if (note := view.texel_note) is not None:
        widgets.one_line(f"{note[:1].upper()}{note[1:]}", theme.AMBER)


def _time(view: View, stats: Stats, times: float) -> str:
    """What solving will still take. times: as many texels as there are now."""
    session = view.session
    left = seconds_left(session.family, threshold(view), stats, session.run.history)
    if left is None:
        return "not known yet"
    if times != 1:
        left = (left + stats.seconds) * times
    return f"about {roughly(left)}" if left > 0 else "all is solved; files are written"


def _begin(view: View, state: State) -> None:
    """The button, and the one to go on where a bake was not finished."""
    session, order = view.session, state.order
    assert order is not None
    why = "a scene is loading" if session.on_its_way is not None else why_not(session)
    kept = order.folder / CHECKPOINT_NAME
    if kept.exists():
        ago = roughly(max(time.time() - kept.stat().st_mtime, 0.0)) if state.measured else "a while"
        widgets.wrapped(f"A bake into this folder was not finished; kept {ago} ago.", theme.AMBER)
        imgui.begin_disabled(why is not None)
        if imgui.button(f"{ICONS.ICON_FA_PLAY} Go on###go on", imgui.ImVec2(-1, 0)):
            state.act(lambda: _start(view, state, resume=True))
        imgui.end_disabled()
        widgets.tooltip(GO_ON if why is None else f"{GO_ON}\nNot now: {why}")
    imgui.begin_disabled(why is not None)
    if imgui.button("Begin anew###bake" if kept.exists() else "Bake###bake", imgui.ImVec2(-1, 0)):
        state.act(lambda: _start(view, state, resume=False))
    imgui.end_disabled()
    what = "Solve on until that is reached, then write scene.glb with its light and a report"
    widgets.tooltip(what if why is None else f"{what}\nNot now: {why}")


def _start(view: View, state: State, *, resume: bool) -> None:
    """Raises UserError."""
    session, order = view.session, state.order
    assert order is not None
    order = replace(order, look=look_of(view))
    if state.atlas is not None and state.atlas != session.atlas:
        order = replace(order, atlas=state.atlas)
    state.baking = Baking(session, order, resume=resume)


def _under_way(view: View, state: State, baking: Baking) -> None:
    """How far it is, and the ways to end it."""
    session = view.session
    loading = session.on_its_way
    stage, share = (baking.stage, baking.share) if loading is None else (loading.stage, loading.fraction)
    stats = state.stats
    assert stats is not None
    left = None
    if state.measured and baking.stage == SOLVING:
        left = seconds_left(session.family, threshold(view), stats, session.run.history)
        share = share if left is None else stats.seconds / max(stats.seconds + left, 1e-9)
    widgets.wrapped(f"{stage[:1].upper()}{stage[1:]}")
    imgui.progress_bar(share, imgui.ImVec2(-1, 0), f"{share:.0%}")
    remains = f"{widgets.percent(stats.remaining)}, to {widgets.percent(threshold(view))}"
    rows = [(words.title(stats.remains), remains)]
    if state.measured and baking.stage == SOLVING:
        rows.append(("Time left", "not known yet" if left is None else f"about {roughly(left)}" if left else "none"))
    widgets.facts("baking", rows)
    if baking.stage == SOLVING and not session.run.running:
        widgets.wrapped("Solving is paused: Space", theme.AMBER)
    widgets.dim(str(baking.order.folder.name))
    widgets.tooltip(str(baking.order.folder))
    width = (imgui.get_content_region_avail().x - imgui.get_style().item_spacing.x) / 2
    if imgui.button("Stop###stop", imgui.ImVec2(width, 0)):
        state.act(baking.stop)
    widgets.tooltip(STOP)
    imgui.same_line()
    imgui.begin_disabled(baking.stage not in (SOLVING, JUDGING))
    if imgui.button("Write now###now", imgui.ImVec2(width, 0)):
        state.act(baking.write_now)
    imgui.end_disabled()
    widgets.tooltip(WRITE)


def threshold(view: View) -> float:
    """How little may remain."""
    return float(getattr(view.session.options, view.session.family.threshold))


def _last(state: State, baking: Baking) -> None:
    """What became of the last bake."""
    if baking.baked is not None:
        widgets.wrapped(f"{ICONS.ICON_FA_CHECK} {baking.order.folder.name}: {names(baking)}", theme.AMBER)
        widgets.tooltip(baking.baked.line)
        if imgui.button(f"{ICONS.ICON_FA_FOLDER_OPEN} Show in folder###show", imgui.ImVec2(-1, 0)):
            state.act(lambda: show_folder(baking.order.folder))
    if baking.note is not None:
        widgets.wrapped(words.plain(f"{baking.note[:1].upper()}{baking.note[1:]}"), theme.DIM)
    widgets.section("Another")


def names(baking: Baking) -> str:
    """The names of the files that were written."""
    assert baking.baked is not None
    return ", ".join(path.name for path in baking.baked.files.paths)
