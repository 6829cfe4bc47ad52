"""Energy, a section of the Solver panel: where the emitted power is, and whether it all is somewhere."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui

from app.render.units import QUANTITIES, measure
from app.scene.model import F64
from app.session.balance import FINE, TOO_MUCH, verdict_of
from app.ui import theme, widgets
from app.ui.state import State
from app.ui.words import plain

if TYPE_CHECKING:
    from app.session.stats import Stats
    from app.session.view import View
    from app.solvers import EnergyBalance

BAR_EM = 0.5  # height of the bar
LEVELS = (
    (theme.ICONS.ICON_FA_CIRCLE_CHECK, theme.GOOD),
    (theme.ICONS.ICON_FA_TRIANGLE_EXCLAMATION, theme.AMBER),
    (theme.ICONS.ICON_FA_CIRCLE_EXCLAMATION, theme.BAD),
)
UNKNOWN = theme.ICONS.ICON_FA_HOURGLASS_HALF, theme.DIM
Row = tuple[str, F64, theme.RGBA, str]  # label, power RGB [W], colour, meaning


def draw(view: View, state: State) -> None:
    """The whole section."""
    stats, family = state.stats, view.session.family
    assert stats is not None
    widgets.section(f"Energy [{QUANTITIES[view.display.quantities]['flows'].unit}]")
    run = view.session.run
    rows = shares(run.energy, stats.remaining, run.progress.escaped, distributes=family.distributes)
    emitted = float(rows[0][1].sum())
    powers = [(float(power.sum()), colour) for _, power, colour, _ in rows[1:]]
    _bar(powers, max(emitted, sum(power for power, _ in powers)))
    if imgui.begin_table("energy", 3, imgui.TableFlags_.sizing_stretch_prop):
        for label, power, colour, meaning in rows:
            imgui.table_next_row()
            imgui.table_next_column()
            imgui.text_colored(imgui.ImVec4(*colour), label)
            widgets.tooltip(meaning)
            imgui.table_next_column()
            widgets.right(widgets.number(_flux(power, view)))
            imgui.table_next_column()
            widgets.right(widgets.percent(min(float(power.sum()) / emitted, 1.0) if emitted > 0 else 0.0))
        imgui.end_table()
    _imbalance(view, stats)


def shares(balance: EnergyBalance, remaining: float, escaped: F64, *, distributes: bool) -> list[Row]:
    """Emitted, and where it is. What is unshot is the one number that says so everywhere, ``remaining`` of what is emitted, and
    what has ``escaped``, RGB [W], is of the same moment; the balance was measured a little before. Where light overshoots
    [Feda92], surfaces have absorbed what will be taken back from them: that is unshot, not absorbed."""
    emitted = (
        "Emitted, about" if balance.estimated else "Emitted",
        balance.emitted,
        theme.TEXT,
        "By all lamps and the sky; not what a lamp sends into a surface that it lies on. How much of a sky enters is estimated "
        "until all of it has shot",
    )
    away = ("Escaped", escaped if distributes else balance.escaped, theme.ESCAPED, "Left the scene where no surface is")
    if not distributes:
        return [emitted, ("Absorbed", balance.absorbed, theme.ABSORBED, "By surfaces, which reflect the rest"), away]
    unshot = remaining * balance.emitted
    kept = np.maximum(balance.emitted - balance.imbalance - escaped - unshot, 0.0)
    return [
        emitted,
        ("Absorbed", kept, theme.ABSORBED, "By surfaces, less what was given ahead and is taken back"),
        away,
        (
            "Unshot",
            unshot,
            theme.UNSHOT,
            "Waits on surfaces and lamps to be shot; what is given ahead and taken back, too",
        ),
    ]


def _flux(power: F64, view: View) -> float:
    """Of power (3,) [W], in what light is counted in: watts of all channels, or lumen."""
    radiometric = view.display.quantities == "radiometric"
    return float(power.sum()) if radiometric else measure(power.tolist(), "photometric")


def _imbalance(view: View, stats: Stats) -> None:
    """What is nowhere, or came from nowhere; how bad that is, and what to do."""
    session = view.session
    coarse, finer = session.coarse, session.finer_maps
    verdict = verdict_of(stats.imbalance, session.family, stats.remaining, coarse=coarse, finer=finer)
    icon, colour = LEVELS[verdict.level] if verdict.known else UNKNOWN
    imgui.text_colored(imgui.ImVec4(*colour), f"{icon} Imbalance")
    _explain()
    imgui.same_line()
    widgets.right(widgets.percent(abs(stats.imbalance)), colour)
    if verdict.text is not None:
        widgets.one_line(plain(verdict.text), colour)
    else:
        imgui.text_unformatted("")  # as high as with something to say


def _explain() -> None:
    widgets.tooltip(
        "The difference between what is emitted and all that became of it, of what is emitted: the error of form factors and "
        f"visibility. Below {widgets.percent(FINE)} it is fine, from {widgets.percent(TOO_MUCH)} on the light is wrong by some "
        "per cent"
    )


def _bar(powers: list[tuple[float, theme.RGBA]], total: float) -> None:
    """Where the emitted power is now, as one bar; a gap at its end is light that is lost."""
    width, height = imgui.get_content_region_avail().x, imgui.get_font_size() * BAR_EM
    corner = imgui.get_cursor_screen_pos()
    left = corner.x
    for power, colour in powers:
        right = min(left + width * max(0.0, power) / total, corner.x + width) if total > 0 else left
        box = imgui.ImVec2(left, corner.y), imgui.ImVec2(right, corner.y + height)
        imgui.get_window_draw_list().add_rect_filled(*box, theme.colour_u32(colour))
        left = right
    imgui.dummy(imgui.ImVec2(width, height))


__all__ = ["draw", "shares"]
