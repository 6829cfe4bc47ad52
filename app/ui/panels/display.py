"""Display: what the picture shows and how it is developed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.render.false_colour import UNITS
from app.ui import widgets
from app.ui.state import State

if TYPE_CHECKING:
    from app.session import Session


def draw(session: Session, state: State) -> None:
    """The whole panel: DisplayOptions, one widget each; the false-colour scale only while it is used."""
    plain = session.display.false_colour == "off"
    skip = ("false_colour_log", "false_colour_max") if plain else ("tone_map", "exposure")
    unit = {} if plain else {"false_colour_max": UNITS[session.display.false_colour]}
    session.display = widgets.edit_options(session.display, skip=skip, units=unit)
    if plain:
        widgets.labelled("Set exposure")
        if imgui.button("Auto", imgui.ImVec2(-1, 0)):
            state.act(session.expose)
        widgets.tooltip(
            "Set the exposure from the light of the scene: what surfaces reflect becomes mid grey on average"
        )
