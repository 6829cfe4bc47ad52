"""Settings in the window: all knobs as tables, and presets and files of them applied as one edit."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.options import Options
from app.session.settings import PRESETS, TABLES, Settings, settings_of, settings_text
from app.ui import widgets
from app.ui.state import Pace, State

if TYPE_CHECKING:
    from app.session.view import View

KNOWN: dict[str, type[Options]] = {**TABLES, "pace": Pace}


def tables(view: View, state: State) -> dict[str, Options]:
    """All settings as they are, by name."""
    session = view.session
    atlas, adaptive = session.asked_cut
    light = session.light.replace(adaptive=adaptive)
    return {
        "texels": atlas,
        "lightmap": light,
        **session.solver_options,
        "display": view.display,
        "pace": state.pace,
    }


def text(view: View, state: State) -> str:
    """A file of them."""
    return settings_text(view.session.chosen_solver, tables(view, state))


def put(view: View, state: State, settings: Settings) -> None:
    """Apply what is given. Raises UserError."""
    session = view.session
    state.pace = settings.of("pace", state.pace)
    view.display = settings.of("display", view.display)
    session.set_solver_options({name: settings.of(name, old) for name, old in session.solver_options.items()})
    asked = session.asked_cut
    atlas, light = settings.of("texels", asked[0]), settings.of("lightmap", session.light.replace(adaptive=asked[1]))
    if session.opened and (atlas, light.adaptive) != asked:
        session.cut_anew(atlas, adaptive=light.adaptive)
    elif not session.opened:
        session.atlas = atlas
    session.set_light(light.replace(adaptive=session.light.adaptive) if session.opened else light)
    if settings.solver is not None:
        session.set_solver(settings.solver)


def menu(view: View, state: State) -> None:
    """Presets, and files."""
    for name in PRESETS:
        if imgui.menu_item(name.capitalize(), "", False)[0]:
            state.act(partial(_put_named, view, state, name))
        widgets.tooltip(_words(settings_of(name)))
    imgui.separator()
    if imgui.menu_item("Open settings ...", "", False)[0]:
        state.ask_for_settings = True
    if imgui.menu_item("Save settings ...", "", False)[0]:
        state.ask_for_settings_name = True


def _put_named(view: View, state: State, source: str) -> None:
    put(view, state, settings_of(source, KNOWN))


def _words(settings: Settings) -> str:
    parts = [f"solver {settings.solver}"] if settings.solver else []
    for table, values in settings.tables.items():
        parts += [f"{table}: {key.replace('_', ' ')} {widgets.shown(value)}" for key, value in values.items()]
    return "\n".join(parts)


__all__ = ["KNOWN", "menu", "put", "tables", "text"]
