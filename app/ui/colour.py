"""Colours in widgets are as a screen shows them (sRGB), and what they stand for is linear Rec.709.

A hex code that is pasted is what it is everywhere else, and a swatch looks as the albedo layer shows the material.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from imgui_bundle import imgui

from app.render.tone_mapping import encode_srgb
from app.scene.images import linear_from_srgb
from app.ui.state import RGB

STEP = 1.0 / 255  # of a hex code
FINEST = 2e-4  # of the shown colour: its numbers have three digits
FLAGS = int(
    imgui.ColorEditFlags_.float
    | imgui.ColorEditFlags_.no_label
    | imgui.ColorEditFlags_.display_hex
    | imgui.ColorEditFlags_.no_options  # a right click puts the default back, as everywhere
)
SWATCH = int(imgui.ColorEditFlags_.no_tooltip | imgui.ColorEditFlags_.no_drag_drop | imgui.ColorEditFlags_.no_border)


def screen_from_linear(linear: RGB) -> RGB:
    """Linear Rec.709 as a screen shows it, [0, 1]."""
    return rgb(encode_srgb(np.clip(np.array(linear, np.float64), 0.0, 1.0)).tolist())


def linear_from_screen(screen: RGB) -> RGB:
    """Linear Rec.709 of what a screen shows, [0, 1]."""
    return rgb(float(c) for c in linear_from_srgb(np.array(screen, np.float32)))


def edit_colour(
    label: str, linear: RGB, *, code: bool = False, most: float = 1.0, typed: dict[RGB, RGB] | None = None
) -> RGB:
    """A swatch that opens a picker; a linear colour in and out, ``linear`` itself where it was not edited. code: with its hex
    code beside it. most: that a channel can be; typed: what was asked for where that is more, by what it was held at, which
    is still shown. Channels that were not edited keep all their digits."""
    shown = (typed or {}).get(linear) or screen_from_linear(linear)
    flags = FLAGS if code else FLAGS | int(imgui.ColorEditFlags_.no_inputs)
    changed, edited = imgui.color_edit3(label, list(shown), flags)
    if not changed or not all(map(math.isfinite, edited)):
        return linear
    screen = rgb(min(max(float(c), 0.0), 1.0) for c in edited)
    by_code = all(abs(c / STEP - round(c / STEP)) < 1e-3 for c in screen)  # which rounds the other channels, too
    same = STEP / 2 if by_code else FINEST
    channels = zip(linear, shown, screen, linear_from_screen(screen), strict=True)
    edited_to = rgb(old if abs(now - was) < same else min(new, most) for old, was, now, new in channels)
    if typed is not None and max(edited_to) >= most:
        typed[edited_to] = screen
    return edited_to


def swatch(label: str, linear: RGB, side: float) -> None:
    """A square of that colour."""
    imgui.color_button(label, imgui.ImVec4(*screen_from_linear(linear), 1), SWATCH, imgui.ImVec2(side, side))


def tint_and_strength(values: RGB, known: RGB = (1.0, 1.0, 1.0)) -> tuple[RGB, float]:
    """Light as a colour whose largest channel is 1 times a strength; of none the colour is the one ``known``."""
    strength = max(values)
    return (rgb(v / strength for v in values), strength) if strength > 0 else (known, strength)


def edit_tint(label: str, tint: RGB) -> RGB:
    """The colour of a light, whose largest channel is 1: how bright it is, is edited apart."""
    edited = edit_colour(label, tint)
    top = max(edited)
    return tint if edited == tint or top <= 0 else rgb(c / top for c in edited)


def rgb(values: Iterable[float]) -> RGB:
    red, green, blue = values
    return red, green, blue
