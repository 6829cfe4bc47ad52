"""What lies over the view: menu bar, status bar, help, progress of loading, false-colour legend, toasts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from app.render.units import QUANTITIES, UNITS
from app.session.balance import verdict_of
from app.ui import bookmarks, edits, files, new_lamps, pointer, recovery, text_size, theme, widgets
from app.ui.keys import POINTER, SHORTCUTS, flip_pace
from app.ui.layout import PANELS
from app.ui.panels.display import counted
from app.ui.state import TOAST_SECONDS, Legend, Request, State
from app.ui.words import plain

if TYPE_CHECKING:
    from app.session.view import View
    from app.util.background import BackgroundTask

ICONS = theme.ICONS
FLOATING = int(
    imgui.WindowFlags_.no_decoration
    | imgui.WindowFlags_.no_docking
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_focus_on_appearing
    | imgui.WindowFlags_.no_nav
    | imgui.WindowFlags_.always_auto_resize
)
LOADING_EM = 24.0
NO_LAMPS_EM = 22.0
TOAST_EM = 34.0
LEGEND_EM = (1.2, 13.0)  # width and height of the colour bar
LEGEND_MARGIN_EM = 1.0


def menu_bar(view: View, state: State) -> None:
    """File, Edit, View, Help."""
    if not imgui.begin_main_menu_bar():
        return
    if imgui.begin_menu("File"):
        files.menu(view, state)
        if imgui.menu_item(f"{ICONS.ICON_FA_CAMERA}  Screenshot", "F12", False)[0]:
            state.requests.append(Request.SCREENSHOT)
        if imgui.menu_item(f"{ICONS.ICON_FA_IMAGE}  Save picture ...", "Ctrl+P", False, view.session.opened)[0]:
            state.ask_for_picture = True
        imgui.separator()
        if imgui.menu_item("Quit", "Ctrl+Q", False)[0]:
            state.quit()
        imgui.end_menu()
    if imgui.begin_menu("Edit"):
        edits.menu(view, state)
        imgui.end_menu()
    if imgui.begin_menu("View"):
        _view_menu(view, state)
        imgui.end_menu()
    if imgui.begin_menu("Help"):
        if imgui.menu_item("Keys", "F1", state.show_help)[0]:
            state.show_help = True
        imgui.end_menu()
    imgui.end_main_menu_bar()


def _view_menu(view: View, state: State) -> None:
    for panel in PANELS:
        clicked, shown = imgui.menu_item(panel.title, "", panel.title not in state.hidden_panels)
        if clicked:
            (state.hidden_panels.discard if shown else state.hidden_panels.add)(panel.title)
    imgui.separator()
    if imgui.begin_menu("Camera", view.session.opened):
        bookmarks.menu(view, state)
        imgui.end_menu()
    if imgui.begin_menu("Quantities", view.session.opened):
        for quantities in UNITS:
            units = ", ".join(dict.fromkeys(unit for _, unit in QUANTITIES[quantities].values()))
            if imgui.menu_item(f"{quantities.capitalize()}: {units}", "", view.display.quantities == quantities)[0]:
                view.display = counted(view.display, quantities)
        imgui.end_menu()
    if imgui.begin_menu("Text size"):
        text_size.menu(state)
        imgui.end_menu()
    if imgui.menu_item("Reset layout", "", False)[0]:
        state.hidden_panels.clear()
        state.rebuild_layout = True
    if imgui.menu_item("Hide the interface", "F2", False)[0]:
        state.show_ui = False


def status_bar(view: View, state: State) -> None:
    """One line at the bottom of the window."""
    flags = imgui.WindowFlags_.no_scrollbar | imgui.WindowFlags_.no_saved_settings | imgui.WindowFlags_.menu_bar
    height = imgui.get_frame_height()
    viewport = imgui.get_main_viewport()
    if (
        imgui.internal.begin_viewport_side_bar("##status", viewport, imgui.Dir.down, height, int(flags))
        and imgui.begin_menu_bar()
    ):
        for text, colour in _status(view, state):
            imgui.text_colored(imgui.ImVec4(*colour), text)
            widgets.copied_by_click(text)
            imgui.separator()
        recovery.offer(state)
        if state.stats is not None:
            _pace(view, state)
            if state.stats.refining and state.stats.leaves:
                widgets.dim(f"quadtrees: {state.stats.leaves}")
                imgui.separator()
        if view.session.message:
            message = plain(view.session.message)
            imgui.text_unformatted(message)
            widgets.copied_by_click(message)
        _under_pointer(view, state)
        imgui.end_menu_bar()
    imgui.end()


def _under_pointer(view: View, state: State) -> None:
    """At the right end, where there is room."""
    text = "   ".join(pointer.in_words(view, state)) if view.session.opened else ""
    left = imgui.get_window_width() - imgui.calc_text_size(text).x - imgui.get_style().window_padding.x
    if text and left > imgui.get_cursor_pos_x():
        imgui.set_cursor_pos_x(left)
        imgui.text_colored(imgui.ImVec4(*theme.AMBER), text)


def _status(view: View, state: State) -> list[tuple[str, theme.RGBA]]:
    stats = state.stats
    if stats is None:
        return [("no scene", theme.DIM) if view.session.on_its_way is None else ("opening", theme.AMBER)]
    word, colour = (
        ("no light", theme.AMBER)
        if not new_lamps.is_lit(view, state)
        else ("converged", theme.GOOD)
        if stats.converged
        else ("running", theme.AMBER)
        if view.session.run.running
        else ("paused", theme.TEXT)
    )
    parts = [f"{widgets.percent(stats.remaining)} {stats.remains}", view.session.family.words(stats.done)]
    if state.measured:
        parts += [f"{widgets.number(stats.per_second, 3)}/s"]
    if state.measured and state.live:
        parts += [f"{state.fps:.0f} fps"]
    wrong = verdict_of(stats.imbalance, view.session.family, stats.remaining, coarse=view.session.coarse).level > 1
    imbalance = f"{ICONS.ICON_FA_CIRCLE_EXCLAMATION} imbalance {widgets.percent(abs(stats.imbalance))}"
    return [
        *((view.session.name, theme.TEXT), (word, colour), *((part, theme.DIM) for part in parts)),
        *([(imbalance, theme.BAD)] if wrong else []),
    ]


def _pace(view: View, state: State) -> None:
    """Which pace is on; a click changes it."""
    fast = state.is_fast(view.session.run.seconds if state.measured else 0.0)
    imgui.text_colored(
        imgui.ImVec4(*theme.DIM), f"{ICONS.ICON_FA_FORWARD}  fast" if fast else f"{ICONS.ICON_FA_EYE}  watch"
    )
    if imgui.is_item_clicked():
        flip_pace(view, state)
    other = "click or P: watch one step after the other" if fast else "click or P: as much as there is time for"
    what = "as many steps between two pictures as there is time for" if fast else "one step between two pictures"
    widgets.tooltip(f"Pace: {what}; {other}")
    imgui.separator()


def help_overlay(state: State) -> None:
    """All keys, while F1 is on: in the middle of the window, to be scrolled where it is too small for them."""
    if not state.show_help:
        return
    room = imgui.get_io().display_size
    middle = imgui.ImVec2(room.x / 2, room.y / 2)
    imgui.set_next_window_pos(middle, imgui.Cond_.always, imgui.ImVec2(0.5, 0.5))
    imgui.set_next_window_size_constraints(imgui.ImVec2(0, 0), room)
    imgui.begin("##help", None, FLOATING & ~imgui.WindowFlags_.no_scrollbar)
    if imgui.begin_table("keys", 2, imgui.TableFlags_.sizing_fixed_fit):
        for label, meaning in (*((s.label, s.help) for s in SHORTCUTS), *bookmarks.KEYS, *text_size.KEYS, *POINTER):
            imgui.table_next_row()
            imgui.table_next_column()
            imgui.text_colored(imgui.ImVec4(*theme.AMBER), label)
            imgui.table_next_column()
            imgui.text_unformatted(meaning)
        imgui.end_table()
    imgui.end()


def invitation(view: View, state: State) -> None:
    """What to do while no scene is open, and where one is dark because it was opened while paused."""
    session, stats = view.session, state.stats
    if session.on_its_way is not None:
        return
    if stats is None:
        _in_the_middle("Drop a scene here, or press Ctrl+O", state)
    elif stats.done == 0 and not session.run.running and not stats.converged and new_lamps.is_lit(view, state):
        _in_the_middle("Paused: press Space to let light in", state)


def _in_the_middle(text: str, state: State) -> None:
    """A line in the view, legible on whatever is behind it."""
    left, top, width, height = state.view_px
    size, lines = imgui.calc_text_size(text), imgui.get_background_draw_list()
    x, y = left + (width - size.x) / 2, top + (height - size.y) / 2
    lines.add_text(imgui.ImVec2(x + 1, y + 1), theme.colour_u32((0, 0, 0, 0.6)), text)
    lines.add_text(imgui.ImVec2(x, y), theme.colour_u32(theme.TEXT), text)


def no_lamps(view: View, state: State) -> None:
    """What to do where nothing shines: a button for each kind of lamp, at the foot of the view."""
    session = view.session
    if not (session.opened and state.show_ui) or session.on_its_way is not None or new_lamps.is_lit(view, state):
        return
    left, top, width, height = state.view_px
    em = imgui.get_font_size()
    foot = imgui.ImVec2(left + width / 2, top + height - em)
    imgui.set_next_window_pos(foot, imgui.Cond_.always, imgui.ImVec2(0.5, 1.0))
    imgui.set_next_window_size(imgui.ImVec2(min(NO_LAMPS_EM * em, width), 0))
    imgui.begin("##no lamps", None, FLOATING & ~int(imgui.WindowFlags_.always_auto_resize))
    widgets.wrapped(f"{new_lamps.dark_in_words(view)}: add a lamp")
    new_lamps.buttons(view, state)
    imgui.end()


def loading_overlay(loading: BackgroundTask[Any] | None, state: State, *, coarse: bool) -> None:
    """Stage, progress and a way out while a scene or a solver is on its way, at the top of the view: the middle shows it flat, or
    with coarse light."""
    if loading is None:
        return
    left, top, width, _ = state.view_px
    middle = imgui.ImVec2(left + width / 2, top + imgui.get_font_size())
    imgui.set_next_window_pos(middle, imgui.Cond_.always, imgui.ImVec2(0.5, 0.0))
    imgui.begin("##loading", None, FLOATING)
    width = min(imgui.get_font_size() * LOADING_EM, width - 2 * imgui.get_style().window_padding.x)
    imgui.push_text_wrap_pos(imgui.get_cursor_pos_x() + width)
    imgui.text_unformatted(loading.stage)
    imgui.pop_text_wrap_pos()
    share = f"{loading.fraction:.0%}" + (", coarse light until then" if coarse else "")
    imgui.progress_bar(min(max(loading.fraction, 0.0), 1.0), imgui.ImVec2(width, 0), share)
    if imgui.button("Cancel", imgui.ImVec2(width, 0)):
        loading.cancel()
    imgui.end()


def toasts(view: View, state: State, seconds: float) -> None:
    """Short lines over the lower edge of the view, for a few seconds or until clicked."""
    if view.session.message != state.last_message:
        state.last_message = view.session.message
        if view.session.message:
            state.notify(view.session.message, error=False)
    for toast in state.toasts:
        toast.seconds += seconds
    state.toasts = [t for t in state.toasts if t.seconds < TOAST_SECONDS]
    left, top, width, height = state.view_px
    bottom = top + height - imgui.get_font_size()
    for index, toast in enumerate(reversed(state.toasts)):
        imgui.set_next_window_pos(imgui.ImVec2(left + width / 2, bottom), imgui.Cond_.always, imgui.ImVec2(0.5, 1.0))
        imgui.begin(f"##toast{index}", None, FLOATING)
        icon = ICONS.ICON_FA_TRIANGLE_EXCLAMATION if toast.error else ICONS.ICON_FA_CIRCLE_INFO
        imgui.text_colored(imgui.ImVec4(*(theme.BAD if toast.error else theme.AMBER)), icon)
        imgui.same_line()
        wrap = min(width - 4 * imgui.get_font_size(), imgui.get_font_size() * TOAST_EM)
        imgui.push_text_wrap_pos(imgui.get_cursor_pos_x() + max(wrap, imgui.get_font_size()))
        imgui.text_unformatted(plain(toast.text))
        imgui.pop_text_wrap_pos()
        if imgui.is_window_hovered() and imgui.is_mouse_clicked(0):
            toast.seconds = TOAST_SECONDS
        bottom -= imgui.get_window_height() + imgui.get_style().item_spacing.y
        imgui.end()


def legend_overlay(legend: Legend | None, state: State) -> None:
    """The false-colour bar with ticks and unit, at the left of the view."""
    if legend is None or not legend.maximum > legend.minimum:
        return
    em = imgui.get_font_size()
    left, top, _, height = state.view_px
    bar_width, bar_height = LEGEND_EM[0] * em, min(LEGEND_EM[1] * em, height - 8 * em)
    if bar_height < 4 * em:
        return
    margin = LEGEND_MARGIN_EM * em
    imgui.set_next_window_pos(imgui.ImVec2(left + margin, top + margin))
    imgui.set_next_window_bg_alpha(0.8)
    imgui.begin("##legend", None, FLOATING | imgui.WindowFlags_.no_inputs)
    imgui.text_unformatted(f"{legend.quantity} [{legend.unit}]")
    imgui.dummy(imgui.ImVec2(0, em / 2))
    corner = imgui.get_cursor_screen_pos()
    draw_list = imgui.get_window_draw_list()
    count = len(legend.colours)
    for index, colour in enumerate(legend.colours):
        y = corner.y + bar_height * (1 - (index + 1) / count)
        box = imgui.ImVec2(corner.x, y), imgui.ImVec2(corner.x + bar_width, y + bar_height / count + 1)
        draw_list.add_rect_filled(*box, theme.colour_u32((*colour, 1.0)))
    for value in ticks(legend.minimum, legend.maximum, legend.logarithmic):
        y = corner.y + bar_height * (1 - place(value, legend))
        dash = imgui.ImVec2(corner.x + bar_width, y), imgui.ImVec2(corner.x + bar_width + em / 3, y)
        draw_list.add_line(*dash, theme.colour_u32(theme.TEXT))
        at = imgui.ImVec2(corner.x + bar_width + em / 2, y - em / 2)
        draw_list.add_text(at, theme.colour_u32(theme.TEXT), f"{value:g}")
    imgui.dummy(imgui.ImVec2(bar_width + 4.5 * em, bar_height + em / 2))
    imgui.end()


def place(value: float, legend: Legend) -> float:
    """Where a value lies on the scale, 0 to 1."""
    if legend.logarithmic:
        return math.log(value / legend.minimum) / math.log(legend.maximum / legend.minimum)
    return (value - legend.minimum) / (legend.maximum - legend.minimum)


def ticks(minimum: float, maximum: float, logarithmic: bool) -> list[float]:
    """Round values between the ends: powers of ten, or with 2 and 5 where those are few; or steps of 1, 2 or 5."""
    if logarithmic:
        decades = range(math.floor(math.log10(minimum)), math.ceil(math.log10(maximum)) + 1)
        factors = (1.0,) if len(decades) > 4 else (1.0, 2.0, 5.0)
        values = [f * 10.0**d for d in decades for f in factors]
    else:
        raw = (maximum - minimum) / 5
        unit = 10.0 ** math.floor(math.log10(raw))
        step = next(f * unit for f in (1, 2, 5, 10) if f * unit >= raw * (1 - 1e-9))
        first = math.ceil(minimum / step - 1e-9)
        values = [step * i for i in range(first, math.floor(maximum / step + 1e-9) + 1)]
    slack = 1e-6 * maximum
    return [v for v in values if minimum - slack <= v <= maximum + slack]
