"""Fonts, colours and spacing: a calm dark theme with one amber accent."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import imgui_bundle
from imgui_bundle import icons_fontawesome_6, imgui, implot

RGBA = tuple[float, float, float, float]

FONT_PX = 15.0
ICON_PX = 13.0
FONTS = Path(imgui_bundle.__file__).parent / "assets" / "fonts"
TEXT_FONT = FONTS / "Roboto" / "Roboto-Regular.ttf"
ICON_FONT = FONTS / "Font_Awesome_6_Free-Solid-900.otf"
ICONS = icons_fontawesome_6


def _rgba(code: int, alpha: float = 1.0) -> RGBA:
    return (code >> 16 & 255) / 255, (code >> 8 & 255) / 255, (code & 255) / 255, alpha


AMBER = _rgba(0xF2A63B)
TEXT = _rgba(0xE4E2DD)
DIM = _rgba(0x9A9890)  # labels, units: 5.6:1 on PANEL
PANEL = _rgba(0x1D1D1F)  # also what the host clears the window to: see ``see_through``
GOOD = _rgba(0x7CB987)
BLUE = _rgba(0x6FA3D8)
BAD = _rgba(0xE5705F)
FRAME, FILL = _rgba(0x2C2C30), _rgba(0x5C4628)  # of a slider: what is left of its value

# What the energy went into, the same in every plot, bar and table
ABSORBED, ESCAPED, UNSHOT = AMBER, BLUE, _rgba(0x8E8C85)
RMS, MEDIAN = BAD, BLUE

_C = imgui.Col_
_COLOURS: dict[imgui.Col_, RGBA] = {
    _C.text: TEXT,
    _C.text_disabled: DIM,
    _C.window_bg: PANEL,
    _C.child_bg: _rgba(0x000000, 0.0),
    _C.popup_bg: _rgba(0x252528),
    _C.border: _rgba(0x3A3A3E),
    _C.border_shadow: _rgba(0x000000, 0.0),
    _C.frame_bg: FRAME,
    _C.frame_bg_hovered: _rgba(0x38383D),
    _C.frame_bg_active: _rgba(0x424248),
    _C.title_bg: _rgba(0x161618),
    _C.title_bg_active: _rgba(0x161618),
    _C.title_bg_collapsed: _rgba(0x161618),
    _C.menu_bar_bg: _rgba(0x000000, 0.0),
    _C.scrollbar_bg: _rgba(0x000000, 0.0),
    _C.scrollbar_grab: _rgba(0x46464B),
    _C.scrollbar_grab_hovered: _rgba(0x5A5A60),
    _C.scrollbar_grab_active: _rgba(0x6B6B72),
    _C.check_mark: AMBER,
    _C.slider_grab: _rgba(0x6B4F2A),
    _C.slider_grab_active: AMBER,
    _C.button: _rgba(0x333338),
    _C.button_hovered: _rgba(0x45454B),
    _C.button_active: _rgba(0x8A6128),
    _C.header: _rgba(0x303035),
    _C.header_hovered: _rgba(0x3D3D43),
    _C.header_active: _rgba(0x4A4A51),
    _C.separator: _rgba(0x343438),
    _C.separator_hovered: _rgba(0xC98A33),
    _C.separator_active: AMBER,
    _C.resize_grip: _rgba(0x000000, 0.0),
    _C.resize_grip_hovered: _rgba(0xC98A33, 0.6),
    _C.resize_grip_active: AMBER,
    _C.tab: _rgba(0x1A1A1C),
    _C.tab_hovered: _rgba(0x3A3A3F),
    _C.tab_selected: PANEL,
    _C.tab_selected_overline: AMBER,
    _C.tab_dimmed: _rgba(0x161618),
    _C.tab_dimmed_selected: PANEL,
    _C.tab_dimmed_selected_overline: _rgba(0x6B5836),
    _C.docking_preview: _rgba(0xF2A63B, 0.5),
    _C.docking_empty_bg: _rgba(0x101011),
    _C.plot_lines: AMBER,
    _C.plot_histogram: _rgba(0x9A6F33),
    _C.table_header_bg: _rgba(0x26262A),
    _C.table_border_strong: _rgba(0x3A3A3E),
    _C.table_border_light: _rgba(0x2C2C30),
    _C.table_row_bg_alt: _rgba(0xFFFFFF, 0.025),
    _C.text_selected_bg: _rgba(0xC98A33, 0.45),
    _C.text_link: AMBER,
    _C.nav_cursor: AMBER,
    _C.modal_window_dim_bg: _rgba(0x000000, 0.55),
}


def apply(scale: float = 1.0) -> None:
    """Set colours and spacing of the current Dear ImGui and ImPlot contexts; ``scale`` enlarges all of it. Between two frames."""
    style, plain = imgui.get_style(), imgui.Style()
    for name in _lengths(plain):
        setattr(style, name, getattr(plain, name))  # scaling what is scaled already would add up
    for index, colour in _COLOURS.items():
        style.set_color_(index, imgui.ImVec4(*colour))
    style.window_rounding = style.child_rounding = style.frame_rounding = style.popup_rounding = 4.0
    style.grab_rounding = style.tab_rounding = style.scrollbar_rounding = 4.0
    style.window_border_size = style.frame_border_size = style.tab_border_size = 0.0
    style.popup_border_size = 1.0
    style.window_padding = imgui.ImVec2(10, 8)
    style.frame_padding = imgui.ImVec2(7, 3)
    style.item_spacing = imgui.ImVec2(7, 5)
    style.item_inner_spacing = imgui.ImVec2(6, 4)
    style.cell_padding = imgui.ImVec2(5, 2)
    style.scrollbar_size = 11.0
    style.grab_min_size = 7.0
    style.docking_separator_size = 2.0
    style.window_menu_button_position = imgui.Dir.none
    style.color_button_position = imgui.Dir.left
    style.scale_all_sizes(scale)
    style.font_scale_dpi = scale
    _style_plots(scale)


def px(length: float) -> float:
    """So many pixels of an ordinary screen, as large as text is here."""
    return length * imgui.get_style().font_scale_dpi


def load_fonts() -> None:
    """Text and icons, once for each context."""
    fonts = imgui.get_io().fonts
    fonts.add_font_from_file_ttf(str(TEXT_FONT), FONT_PX)
    icons = imgui.ImFontConfig()
    icons.merge_mode = True
    icons.glyph_offset = imgui.ImVec2(0, 1)
    icons.glyph_min_advance_x = FONT_PX  # a narrow one does not touch the word after it
    fonts.add_font_from_file_ttf(str(ICON_FONT), ICON_PX, icons)


def _lengths(style: Any) -> list[str]:
    """Which fields of a style are lengths; those of fonts are not."""
    names = [name for name in dir(style) if not name.startswith(("_", "font"))]
    return [name for name in names if isinstance(getattr(style, name), (float, imgui.ImVec2))]


def _style_plots(scale: float) -> None:
    style, plain = implot.get_style(), implot.Style()
    for name in _lengths(plain):
        length = getattr(plain, name)
        larger = length * scale if isinstance(length, float) else imgui.ImVec2(length.x * scale, length.y * scale)
        setattr(style, name, larger)
    for index, colour in {
        implot.Col_.frame_bg: _rgba(0x000000, 0.0),
        implot.Col_.plot_bg: _rgba(0x000000, 0.0),
        implot.Col_.plot_border: _rgba(0x3A3A3E),
        implot.Col_.legend_bg: _rgba(0x252528, 0.85),
        implot.Col_.legend_border: _rgba(0x000000, 0.0),
        implot.Col_.legend_text: TEXT,
        implot.Col_.axis_text: DIM,
        implot.Col_.axis_grid: _rgba(0xFFFFFF, 0.10),
        implot.Col_.crosshairs: AMBER,
    }.items():
        style.set_color_(index, imgui.ImVec4(*colour))
    style.plot_padding = imgui.ImVec2(16 * scale, 4 * scale)  # half a label stands out on the right
    style.label_padding = imgui.ImVec2(4 * scale, 3 * scale)
    style.legend_inner_padding = imgui.ImVec2(6 * scale, 4 * scale)
    style.legend_padding = imgui.ImVec2(8 * scale, 2 * scale)
    style.minor_alpha = 0.35


@contextlib.contextmanager
def see_through(wanted: bool = True) -> Iterator[None]:
    """Windows begun inside have no background of their own: the window is cleared to PANEL already, and on a software
    rasteriser drawing it again would cost more than all the rest of the interface."""
    imgui.push_style_color(_C.window_bg, imgui.ImVec4(*PANEL[:3], 0.0 if wanted else 1.0))
    try:
        yield
    finally:
        imgui.pop_style_color()


def colour_u32(colour: RGBA, alpha: float = 1.0) -> int:
    """A colour as draw lists take it."""
    return int(imgui.get_color_u32(imgui.ImVec4(*colour[:3], colour[3] * alpha)))
