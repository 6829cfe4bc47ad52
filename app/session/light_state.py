"""The light of an open session as it is kept, and taken up again by another session of the same scene and the same settings.

A solve that goes on from there comes to the same light as one that was never stopped.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from app import __version__
from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.lightmap.options import LightmapOptions
from app.options import Options
from app.scene.arrays import arrays_of
from app.session.session import Session
from app.solvers import SOLVERS
from app.util import cache
from app.util.state import State, StateError, fitting

OF = "of"  # what the light is of: its digest and settings


def light_state(session: Session) -> State:
    """All that the light of the open scene, as it was edited, goes on from. Waits for the GPU."""
    state = State({OF: _light_of(session)})
    state.put("lightmap", session.lightmap.state())
    state.put("solver", session.solver.state())
    state.put("run", session.run.state())
    return state


def restore_light(session: Session, state: State) -> None:
    """Go on from such a state: the session has the same scene open, edited as it was, with the same settings. Raises UserError,
    in one line, where it has not, or the state is damaged; the light then begins anew."""
    with fitting():
        why = _difference(state.values[OF], _light_of(session))
    if why is not None:
        raise UserError(why)
    session.restart()
    try:
        with fitting():
            session.lightmap.restore(state.part("lightmap"))
            session.solver.restore(state.part("solver"))
            session.light_restored(state.part("run"))
    except StateError as error:
        session.restart()
        raise UserError(f"the light that was kept is damaged: {error}") from error


@dataclass(frozen=True)
class Settings:
    """By which light was solved that is kept."""

    solver: str
    options: Options
    light: LightmapOptions
    atlas: AtlasOptions


def settings_of(state: State) -> Settings:
    """Those that a session must have to go on from a state. Raises UserError where there are no such."""
    with fitting():
        of = state.values[OF]
        solver = of["solver"]
        options = SOLVERS[solver].options(**of["options"])
        return Settings(solver, options, LightmapOptions(**of["light"]), AtlasOptions(**of["atlas"]))


def _light_of(session: Session) -> dict[str, Any]:
    """What the light is of, in plain values."""
    charts = session.charts
    arrays = arrays_of(session.edited_scene) | {
        "uv": charts.face_uv,
        "face": charts.face_triangle,
        "back": charts.face_back,
    }
    return {
        "glowtree": __version__,
        "solver": session.solver_name,
        "options": session.options.as_dict(),
        "light": session.light.as_dict(),
        "atlas": session.atlas.as_dict(),
        "scene": cache.digest(b"scene", arrays),
    }


def _difference(kept: dict[str, Any], now: dict[str, Any]) -> str | None:
    """What to say where the light is of something else. How little may remain only says when to stop: it may be another."""
    stops = "--" + SOLVERS[now["solver"]].threshold
    for name in ("glowtree", "solver", "options", "light", "atlas"):
        before, after = (_flags(name, of[name]) for of in (kept, now))
        for flag, value in after.items():
            if flag != stops and before.get(flag) != value:
                return f"the light that was kept is of {flag} {_text(before.get(flag))}, not {_text(value)}"
    if kept["scene"] != now["scene"]:
        return "the light that was kept is of another scene: it, or its materials, lamps or sky have changed"
    return None


def _flags(name: str, value: Any) -> dict[str, Any]:
    """Settings as the command line has them, by flag."""
    named = value if isinstance(value, dict) else {name: value}
    return {name if name == "glowtree" else "--" + name.replace("_", "-"): value for name, value in named.items()}


def _text(value: Any) -> str:
    return "unset" if value is None else str(value)


__all__ = ["Settings", "light_state", "restore_light", "settings_of"]
