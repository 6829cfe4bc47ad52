"""The light of an open session as it is kept, and taken up again by another session of the same scene and the same settings.

A solve that goes on from there comes to the same light as one that was never stopped.
"""

from __future__ import annotations

from typing import Any

from app import __version__
from app.errors import UserError
from app.scene.arrays import arrays_of
from app.session.session import Session
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
    session.solver.reset()
    try:
        with fitting():
            session.lightmap.restore(state.part("lightmap"))
            session.solver.restore(state.part("solver"))
            session.light_restored(state.part("run"))
    except StateError as error:
        session.restart()
        raise UserError(f"the light that was kept is damaged: {error}") from error


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
        "--solver": session.solver_name,
        **{_flag(name): value for name, value in session.options.as_dict().items()},
        **{_flag(name): value for name, value in session.light.as_dict().items()},
        **{_flag(name): value for name, value in session.atlas.as_dict().items()},
        "scene": cache.digest(b"scene", arrays),
    }


def _flag(name: str) -> str:
    return "--" + name.replace("_", "-")


def _difference(kept: dict[str, Any], now: dict[str, Any]) -> str | None:
    """What to say where the light is of something else."""
    for name, value in now.items():
        if kept.get(name) != value:
            if name == "scene":
                return "the light that was kept is of another scene: it, or its materials, lamps or sky have changed"
            return f"the light that was kept is of {name} {_text(kept.get(name))}, not {_text(value)}"
    return None


def _text(value: Any) -> str:
    return "unset" if value is None else str(value)


__all__ = ["light_state", "restore_light"]
