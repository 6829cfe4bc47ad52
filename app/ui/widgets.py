"""Widgets that follow from declared options, and the few others that the panels share."""

from __future__ import annotations

import dataclasses
import functools
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar

from imgui_bundle import imgui

from app.options import Options, Spec, specs
from app.ui import slider, theme
from app.ui.words import BY_HAND, meaning

OptionsT = TypeVar("OptionsT", bound=Options)

LABEL_SHARE = 0.44  # of the panel's width
TOOLTIP_EM = 22.0
COPIED_SECONDS = 1.0  # that it is said
FEW = 1e4  # that four digits show
ROUNDING = 1e-6  # of 32-bit numbers
GROUPED = re.compile(r"(?<=\d),(?=\d{3})")
AS_READ = "Right-click: as in the file"
SLIDES = f"{BY_HAND}; right-click: as in the file"
TOOLTIP = int(imgui.HoveredFlags_.for_tooltip | imgui.HoveredFlags_.allow_when_disabled)


def edit_options(
    options: OptionsT,
    *,
    skip: Iterable[str] = (),
    only: Iterable[str] | None = None,
    off: Mapping[str, str] | None = None,
    starts: Mapping[str, Any] | None = None,
    units: Mapping[str, str] | None = None,
    choices: Mapping[str, tuple[str, ...]] | None = None,
    names: Mapping[str, Mapping[str, str]] | None = None,
) -> OptionsT:
    """One widget per declared option; returns ``options`` itself, or a checked copy where something was changed.

    A right-click puts the default back. Labels of options that are not at their default are bright.
    ``only`` some of them, in that order, or all but ``skip``. ``off`` says of options that have no effect now why, besides
    what is declared of them: they are grey.
    ``starts`` are the values that optional ones have while they are not given one, and begin with when they are; ``units`` and
    ``choices`` what is shown instead of those that are declared; ``names`` what choices are called.
    """
    imgui.push_id(type(options).__name__)
    changes: dict[str, Any] = {}
    kind: Any = type(options)
    declared = {spec.name: spec for spec in _specs(kind)}
    for spec in (declared[name] for name in only or declared):
        if spec.name not in skip:
            value = getattr(options, spec.name)
            unit, offered = (units or {}).get(spec.name, spec.unit), (choices or {}).get(spec.name, spec.choices)
            same = (unit, offered) == (spec.unit, spec.choices)
            shown_as = spec if same else _shown_as(spec, unit, offered)
            reason = (off or {}).get(spec.name) or (spec.off(options) if spec.off is not None else None)
            edited = edit_option(
                shown_as, value, (starts or {}).get(spec.name), off=reason, names=(names or {}).get(spec.name)
            )
            if edited != value:
                changes[spec.name] = edited
    imgui.pop_id()
    return options.replace(**changes) if changes else options


@functools.lru_cache
def _shown_as(spec: Spec, unit: str, choices: tuple[Any, ...]) -> Spec:
    """With another unit and other choices than are declared."""
    return dataclasses.replace(spec, unit=unit, choices=choices)


@functools.cache
def _specs(options: type[Options]) -> list[Spec]:
    return specs(options)


def edit_option(
    spec: Spec, value: Any, start: Any = None, *, off: str | None = None, names: Mapping[str, str] | None = None
) -> Any:
    """The widget of one option; the legal value that it holds afterwards. off: why it has no effect now, if it has none. names:
    what its choices are called, where that is not what they are."""
    labelled(spec.title, changed=value != spec.default and off is None)
    imgui.push_id(spec.name)
    imgui.begin_disabled(off is not None)
    if spec.optional:
        value = _optional(spec, value, start)
    edited = value if value is None else _editor(spec, value, start, names or {})
    imgui.end_disabled()
    edited = edited if off is not None else put_back(edited, spec.default)
    if imgui.is_item_hovered(TOOLTIP):
        tooltip(meaning(spec, off))
    imgui.pop_id()
    return edited


def put_back(value: Any, default: Any) -> Any:
    """``default`` where the last item was right-clicked, which means that everywhere; else ``value``."""
    if imgui.is_item_hovered(imgui.HoveredFlags_.allow_when_disabled) and imgui.is_mouse_clicked(1):
        imgui.internal.clear_active_id()
        return default
    return value


def shown(value: Any) -> str:
    """A value as a tooltip names it."""
    if isinstance(value, bool):
        return "on" if value else "off"
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def _optional(spec: Spec, value: Any, start: Any) -> Any:
    changed, on = imgui.checkbox("##given", value is not None)
    if changed:
        first = spec.default if start is None else start
        least = "" if spec.type is str else spec.type(spec.minimum or 0)
        value = (least if first is None else first) if on else None
    if value is not None or start is not None:
        imgui.same_line()
    if value is None and start is not None:
        dim(f"{short(start) if spec.type is float else f'{start:,}'} {spec.unit}")
    return value


def _editor(spec: Spec, value: Any, start: Any, names: Mapping[str, str]) -> Any:
    imgui.set_next_item_width(-1)
    if spec.type is bool:
        return imgui.checkbox("##value", value)[1]
    if spec.choices:
        index = spec.choices.index(value)
        called = [names.get(str(choice), str(choice)) for choice in spec.choices]
        return spec.choices[imgui.combo("##value", index, called, len(called))[1]]  # all of them, without scrolling
    if spec.type in (int, float):
        return _number(spec, value, start)
    return imgui.input_text("##value", value)[1]


def _number(spec: Spec, value: float, start: float | None) -> float:
    """A slider, or where no end is known a drag. start: what 0 means, where that is a number."""
    unit = " " + spec.unit.replace("%", "%%") if spec.unit else ""
    assert spec.minimum is not None and spec.maximum is not None, "a number that a widget edits has ends"
    multiple = spec.multiple if spec.type is int else 0
    ends = slider.Range(
        spec.minimum, spec.maximum, usual=spec.usual, logarithmic=spec.logarithmic, multiple=multiple, start=start
    )
    # Dear ImGui shows a format without a number as it stands
    digits = f"{value:,}" if spec.type is int else _format(value) if spec.logarithmic else f"%.{ends.decimals}f"
    text = spec.zero if value == 0 and spec.zero else digits + unit
    edited = slider.slide("##value", value, ends, text)
    return spec.type(edited) if edited != value else value


def labelled(text: str, *, changed: bool = False) -> None:
    """A label in the left column; the next widget comes in the right one."""
    imgui.align_text_to_frame_padding()
    imgui.text_colored(imgui.ImVec4(*(theme.TEXT if changed else theme.DIM)), text)
    imgui.same_line(imgui.get_content_region_avail().x * LABEL_SHARE + imgui.get_style().window_padding.x)


def tooltip(text: str) -> None:
    """Wrapped help for the last item, after a short stay."""
    if imgui.is_item_hovered(TOOLTIP):
        imgui.begin_tooltip()
        imgui.push_text_wrap_pos(imgui.get_font_size() * TOOLTIP_EM)
        imgui.text_unformatted(text)
        imgui.pop_text_wrap_pos()
        imgui.end_tooltip()


def facts(name: str, rows: Sequence[tuple[str, str]]) -> None:
    """A table of labels and values, both wrapped in their columns."""
    if not rows or not imgui.begin_table(name, 2, imgui.TableFlags_.sizing_stretch_prop):
        return
    imgui.table_setup_column("label", imgui.TableColumnFlags_.width_stretch, LABEL_SHARE)
    imgui.table_setup_column("value", imgui.TableColumnFlags_.width_stretch, 1 - LABEL_SHARE)
    for label, value in rows:
        imgui.table_next_row()
        imgui.table_next_column()
        wrapped(label, theme.DIM)
        imgui.table_next_column()
        wrapped(value)
        copied_by_click(value)
    imgui.end_table()


def copied_by_click(text: str) -> None:
    """The last item is a text that a click copies: numbers without what groups their digits."""
    if not imgui.is_item_hovered():
        return
    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    line = imgui.ImVec2(low.x, high.y), imgui.ImVec2(high.x, high.y)
    imgui.get_window_draw_list().add_line(*line, theme.colour_u32(theme.DIM))
    imgui.set_mouse_cursor(imgui.MouseCursor_.hand)
    key, storage = imgui.get_id(f"copied {low.x:.0f} {low.y:.0f}"), imgui.get_state_storage()
    if imgui.is_mouse_clicked(0):
        imgui.set_clipboard_text(GROUPED.sub("", text))
        storage.set_float(key, imgui.get_time() + COPIED_SECONDS)
    if imgui.get_time() < storage.get_float(key, -1.0):
        imgui.set_tooltip("copied")


def one_line(text: str, colour: theme.RGBA = theme.TEXT) -> None:
    """As much of a text as fits, the whole in its tooltip: nothing moves when it comes or goes."""
    room, shown = imgui.get_content_region_avail().x, text
    if imgui.calc_text_size(text).x > room:
        kept = len(text)
        while kept > 0 and imgui.calc_text_size(shown).x > room:
            kept -= 1
            shown = f"{text[:kept].rstrip()} ..."
    imgui.text_colored(imgui.ImVec4(*colour), shown)
    if shown != text:
        tooltip(text)


def dim(text: str) -> None:
    imgui.push_style_color(imgui.Col_.text, imgui.ImVec4(*theme.DIM))
    imgui.text_unformatted(text)
    imgui.pop_style_color()


def right(text: str, colour: theme.RGBA = theme.TEXT) -> None:
    """Text that ends at the right edge of its column."""
    imgui.set_cursor_pos_x(
        imgui.get_cursor_pos_x() + max(0.0, imgui.get_content_region_avail().x - imgui.calc_text_size(text).x)
    )
    imgui.text_colored(imgui.ImVec4(*colour), text)
    copied_by_click(text)


def steady_width() -> float:
    """Width of a window's inside, whether it has a scroll bar or not: pictures that are as wide cannot make one come and go."""
    style = imgui.get_style()
    return max(imgui.get_window_width() - 2 * style.window_padding.x - style.scrollbar_size, 1.0)


def wrapped(text: str, colour: theme.RGBA = theme.TEXT) -> None:
    imgui.push_style_color(imgui.Col_.text, imgui.ImVec4(*colour))
    imgui.push_text_wrap_pos(0.0)
    imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()
    imgui.pop_style_color()


def section(text: str) -> None:
    """A headline inside a panel."""
    imgui.separator_text(text)


def fold(text: str, *, opened: bool = True) -> bool:
    """A headline that folds away what is below it; whether that is shown. opened: at first. A button beside it may have the same
    words."""
    imgui.set_next_item_open(opened, imgui.Cond_.once)
    clear = imgui.ImVec4(0, 0, 0, 0)
    imgui.push_style_color(imgui.Col_.header, clear)
    imgui.push_style_var(imgui.StyleVar_.frame_padding, imgui.ImVec2(0, imgui.get_style().frame_padding.y))
    shown = imgui.collapsing_header(f"{text}###section {text}")
    imgui.pop_style_var()
    imgui.pop_style_color()
    return shown


def begin_modal(title: str) -> bool:
    """Whether the popup of that title is open, in the middle of the window and as large as what is in it; ``end_popup`` then."""
    imgui.set_next_window_pos(imgui.get_main_viewport().get_center(), imgui.Cond_.always, imgui.ImVec2(0.5, 0.5))
    flags = imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_saved_settings
    return bool(imgui.begin_popup_modal(title, None, flags)[0])


def number(value: float, digits: int = 4) -> str:
    """``digits`` significant ones, thousands apart, no exponent between 0.001 and a thousand million."""
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    if 1e-3 <= abs(value) < 1e9:
        decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
        return f"{value:,.{decimals}f}"
    return f"{value:.{digits - 1}e}"


def short(value: float) -> str:
    """A value as the slider of an option shows it: four digits, but no zeros at the end of a fraction."""
    return _format(value) % value


def _format(value: float) -> str:
    return "%.4g" if abs(value) < FEW else "%.0f"


def percent(fraction: float) -> str:
    """A fraction as per cent: one decimal from 10 on, two down to 0.1, then two digits."""
    share = fraction * 100
    if not math.isfinite(share) or share == 0 or abs(share) >= 0.1:
        return f"{share:.1f} %" if abs(share) >= 10 else f"{share:.2f} %"
    return f"{share:.{min(1 - math.floor(math.log10(abs(share))), 9)}f} %"


def triple(values: Sequence[float], digits: int = 4) -> str:
    """Three numbers; 0 where one is nothing but the rounding of the largest."""
    least = max(abs(float(v)) for v in values) * ROUNDING
    return "  ".join(number(float(v) if abs(v) > least else 0.0, digits) for v in values)


def duration(seconds: float) -> str:
    """In words: ``42 s``, ``3 min 20 s``, ``2 h 5 min``."""
    whole = round(seconds)
    minutes, hours = whole // 60, whole // 3600
    if hours:
        return f"{hours} h {minutes % 60} min"
    return f"{minutes} min {whole % 60} s" if minutes else f"{whole} s"
