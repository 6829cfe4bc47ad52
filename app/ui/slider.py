"""The slider of all numbers: dragged from where it is, by a tenth with Shift; a double click or Ctrl+click types a value.

What spans decades moves by factors: DECADE_PX of the mouse are a factor of ten, whatever the range is.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator

from imgui_bundle import imgui

from app.ui import theme

SPAN_PX = 300.0  # of the mouse, at 96 dots per inch, for the whole of a linear range,
STEP_PX = 24.0  # but no more than this for a whole number
DECADE_PX = 100.0
FINE = 0.1  # of all that, with Shift
LEAST = 1e-4  # of a number that may be 0 and moves by factors: below it comes 0
STILL = 1e-30  # Dear ImGui does not move it by itself
FLAGS = int(
    imgui.SliderFlags_.always_clamp | imgui.SliderFlags_.no_round_to_format | imgui.SliderFlags_.no_speed_tweaks
)


class Range:
    """Where a value lies on a slider, in px of the mouse, and back. usual: the ends that are shown, inside of what is legal.
    multiple: of which a whole number is one; 0 for what is no whole number. start: from where a value of 0 is dragged, where the
    number moves by factors."""

    def __init__(
        self,
        low: float,
        high: float,
        *,
        usual: tuple[float, float] | None = None,
        logarithmic: bool = False,
        multiple: int = 0,
        start: float | None = None,
    ) -> None:
        self.low, self.high, self.logarithmic, self.multiple = low, high, logarithmic, multiple
        self._usual = usual or (low, high)
        self._least = low if low > 0 else float(multiple) if multiple else LEAST
        self._start = start or self._least
        span = self._usual[1] - self._usual[0]
        self._per_px = span / SPAN_PX if not multiple else max(span / SPAN_PX, multiple / STEP_PX)

    @property
    def decimals(self) -> int:
        """Of a number that does not move by factors: as many as a pixel of the mouse changes."""
        return max(math.ceil(-math.log10(self._per_px)), 0)

    def position(self, value: float) -> float:
        """Where a value lies [px]."""
        if not self.logarithmic:
            return (value - self.low) / self._per_px
        return DECADE_PX * math.log10(max(value if value > 0 else self._start, self._least))

    @property
    def reach(self) -> tuple[float, float]:
        """Positions of the ends [px]; of what moves by factors and may be 0, 0 lies a pixel below the least."""
        zero = self.logarithmic and self.low <= 0
        return (self.position(self._least) - 1.0 if zero else self.position(self.low)), self.position(self.high)

    def value(self, position: float) -> float:
        """At a position [px]: a legal one."""
        if self.logarithmic:
            value = 10.0 ** min(position / DECADE_PX, 300.0)
            value = self.low if value < self._least * (1 - 1e-6) else value
        else:
            value = self.low + position * self._per_px
        return self.legal(value)

    def legal(self, value: float) -> float:
        """The nearest that is allowed."""
        if self.multiple:
            value = round(value / self.multiple) * self.multiple
        return min(max(value, self.low), self.high)

    def share(self, value: float) -> float:
        """How much of the slider is filled, 0 to 1."""
        low, high = self._usual
        if self.logarithmic:
            low, high, value = (math.log(max(v, self._least)) for v in (low, high, value))
        return min(max((value - low) / (high - low), 0.0), 1.0) if high > low else 0.0


def slide(label: str, value: float, ends: Range, text: str) -> float:
    """The widget, as wide as the next item; ``value`` itself where it was not moved. text: a format with one number, or none."""
    with _filled(ends.share(value)):
        changed, new = (
            imgui.drag_int(label, int(value), STILL, int(ends.low), int(ends.high), text, FLAGS)
            if ends.multiple
            else imgui.drag_float(label, value, STILL, ends.low, ends.high, text, FLAGS)
        )
    typing = imgui.internal.temp_input_is_active(imgui.get_item_id())
    if not typing and (imgui.is_item_active() or imgui.is_item_hovered()):
        imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew)
    if typing or not imgui.is_item_active():
        return _typed(value, new, ends) if changed else value
    return _dragged(value, ends)


def _dragged(value: float, ends: Range) -> float:
    """By the mouse, from where it was when it was taken: a value that is a whole number would not move by small steps."""
    identity, storage, io = imgui.get_item_id(), imgui.get_state_storage(), imgui.get_io()
    moved = io.mouse_delta.x / imgui.get_style().font_scale_dpi * (FINE if io.key_shift else 1.0)
    if imgui.is_item_activated():
        storage.set_float(identity, ends.position(value))
        return value
    if not moved:
        return value
    lowest, highest = ends.reach
    position = min(max(storage.get_float(identity) + moved, lowest), highest)
    storage.set_float(identity, position)
    return ends.value(position)


def _typed(value: float, new: float, ends: Range) -> float:
    """What is no number changes nothing, nor what 32-bit floats hold of the same."""
    same = not math.isfinite(new) or abs(new - value) <= 1e-6 * abs(value)
    return value if same else ends.legal(new)


@contextlib.contextmanager
def _filled(share: float) -> Iterator[None]:
    """The frame of the item that is drawn inside, filled from the left."""
    corner, rounding = imgui.get_cursor_screen_pos(), imgui.get_style().frame_rounding
    width, height = imgui.calc_item_width(), imgui.get_frame_height()
    for part, colour in ((1.0, theme.FRAME), (share, theme.FILL)):
        end = imgui.ImVec2(corner.x + part * width, corner.y + height)
        imgui.get_window_draw_list().add_rect_filled(corner, end, theme.colour_u32(colour), rounding)
    for index, alpha in (
        (imgui.Col_.frame_bg, 0.0),
        (imgui.Col_.frame_bg_hovered, 0.06),
        (imgui.Col_.frame_bg_active, 0.1),
    ):
        imgui.push_style_color(index, imgui.ImVec4(1.0, 1.0, 1.0, alpha))
    try:
        yield
    finally:
        imgui.pop_style_color(3)
