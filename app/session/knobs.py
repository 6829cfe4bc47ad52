"""What of a view and its session can be edited by hand, undone, and kept: materials, lamps, sky, options, camera."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from app.options import Options
from app.render.camera import CameraView
from app.render.options import DisplayOptions
from app.scene.area_lamps import Surfaces, keys_of
from app.scene.model import Material
from app.session.edits import Knob
from app.session.versions import MaterialEdits
from app.session.view import View

WHEEL_SECONDS = 0.5  # between two notches of the wheel, at most, that are one move of the camera
LOOKS = ("layer", "show", "split")  # display options that say what one looks at: no edits


def knobs_of(view: View) -> tuple[Knob, ...]:
    """All knobs of an open scene."""
    session = view.session
    return (
        Knob("surfaces", lambda: session.asked_surfaces, session.change_surfaces, _surfaces, waits=True),
        Knob(
            "materials",
            lambda: session.material_edits,
            session.set_material_edits,
            lambda a, b: _materials(a, b, session.unedited.materials),
        ),
        Knob("lights", lambda: session.edited_scene.lights, session.set_lights, _lights),
        Knob("sky", lambda: session.edited_scene.sky, session.set_sky, _sky),
        Knob("solver", lambda: session.chosen_solver, session.set_solver, lambda a, b: "solver", waits=True),
        Knob("options", lambda: dict(session.solver_options), session.set_solver_options, _solvers),
        Knob("light", lambda: session.light.replace(adaptive=False), lambda v: _put_light(view, v), said),
        Knob(
            "texels",
            lambda: session.asked_cut,
            lambda v: session.cut_anew(v[0], adaptive=v[1]),
            lambda a, b: "texels",
            waits=True,
        ),
        Knob("display", lambda: _display(view.display), lambda v: _put_display(view, v), said),
        Knob(
            "camera",
            lambda: _place(view.camera),
            lambda v: _put_place(view.camera, v),
            lambda a, b: "camera",
            pause=WHEEL_SECONDS,
        ),
    )


def _put_light(view: View, light: Any) -> None:
    view.session.set_light(light.replace(adaptive=view.session.light.adaptive))


def _display(display: DisplayOptions) -> DisplayOptions:
    return display.replace(layer="combined", show="solution", split=0.5)


def _put_display(view: View, display: DisplayOptions) -> None:
    view.display = display.replace(**{name: getattr(view.display, name) for name in LOOKS})


def _place(camera: CameraView) -> tuple[Any, ...]:
    return (*camera.world_from_camera.ravel().tolist(), camera.yfov, camera.distance)


def _put_place(camera: CameraView, place: tuple[Any, ...]) -> None:
    camera.world_from_camera = np.array(place[:16]).reshape(4, 4)
    camera.yfov, camera.distance = place[16:]


# -- in words ----------------------------------------------------------------------------------------------------------


def differing(before: Any, after: Any) -> list[str]:
    """Names of the fields in which two of a dataclass differ."""
    names = [field.name for field in dataclasses.fields(before)]
    return [name for name in names if _differ(getattr(before, name), getattr(after, name))]


def _differ(before: Any, after: Any) -> bool:
    arrays = isinstance(before, np.ndarray) or isinstance(after, np.ndarray)
    return before is not after if arrays else bool(before != after)


def said(before: Any, after: Any) -> str:
    """Which options differ, in words."""
    names = [name.replace("_", " ") for name in differing(before, after)]
    return ", ".join(names) if len(names) <= 2 else f"{len(names)} options"


def _solvers(before: Mapping[str, Options], after: Mapping[str, Options]) -> str:
    return ", ".join(said(before[name], after[name]) for name in before if before[name] != after[name])


def _surfaces(before: Surfaces, after: Surfaces) -> str:
    if before.scales != after.scales:
        names = {name for (name, _), _ in set(before.scales) ^ set(after.scales)}
        return f"texel density of {', '.join(sorted(names)) or 'the material'}"
    if before.removed != after.removed:
        return f"lamp {'added' if len(after.removed) < len(before.removed) else 'removed'}"
    if before.moved != after.moved:
        return "lamp moved"
    return _things(before.lamps, after.lamps, "lamp")


def _materials(before: MaterialEdits, after: MaterialEdits, came: Sequence[Material]) -> str:
    """Edits of materials, and these as they came."""
    known = dict(zip(keys_of(came), came, strict=True))
    others = [key for key in known if before.get(key) != after.get(key)]
    one, other = ([edits.get(key, known[key]) for key in others] for edits in (before, after))
    return _things(one, other, "material")


def _lights(before: Sequence[Any], after: Sequence[Any]) -> str:
    return _things(before, after, "lamp")


def _things(before: Sequence[Any], after: Sequence[Any], kind: str) -> str:
    if len(before) != len(after):
        return f"{kind} {'added' if len(after) > len(before) else 'removed'}"
    others = [(a, b) for a, b in zip(before, after, strict=True) if a != b]
    if len(others) != 1:
        return f"{len(others)} {kind}s"
    words = said(*others[0])
    return f"{words} of {others[0][1].name or f'the {kind}'}"


def _sky(before: Any, after: Any) -> str:
    return "sky" if before is None or after is None else f"{said(before, after)} of the sky"


__all__ = ["differing", "knobs_of", "said"]
