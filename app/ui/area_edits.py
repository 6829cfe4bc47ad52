"""Edits of lamps with area: copied, taken away, moved, and those that were added here of another size and turned.

A lamp of the scene's own is moved with all surfaces of its material, where these are pieces of their own.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from app.scene.area_lamps import AreaLamp, Moved, keys_of, middle_of
from app.scene.lamp_surfaces import hangs_together, new_name
from app.ui.state import RGB, State

if TYPE_CHECKING:
    from app.session.view import View

LOADING = "a scene is loading"
JOINED = "its surfaces are part of a larger piece, which would have a hole where they are now"


def lamps(view: View, state: State) -> list[int]:
    """Materials that are somewhere and emit, or came so, or were dimmed to nothing here."""
    came, now = view.session.unedited.materials, view.session.materials
    return [index for index in used_materials(view, state) if now[index].emits or came[index].emits]


def used_materials(view: View, state: State) -> tuple[int, ...]:
    """Those that are on some triangle."""
    scene = view.session.unedited
    if state.used[0] is not scene:
        state.used = scene, tuple(np.unique(scene.material_ids).tolist())
    return state.used[1]


def added_lamp(view: View, index: int) -> AreaLamp | None:
    """The lamp with area that material ``index`` is of, if it was added."""
    session = view.session
    if index < len(session.read.materials):
        return None
    name = session.materials[index].name
    return next(lamp for lamp in session.surfaces.lamps if lamp.name == name)


def lamp_of(view: View, state: State, index: int) -> AreaLamp:
    """The lamp of material ``index``: as it was added; one of the scene's own as if it were a copy of itself."""
    lamp = added_lamp(view, index)
    if lamp is not None:
        return lamp
    session = view.session
    known = state.own_lamps
    if known[0] is not session.unedited:
        known = state.own_lamps = session.unedited, {}
    if index not in known[1]:
        x, y, z = middle_of(session.unedited, index).tolist()
        name, key = session.materials[index].name, keys_of(session.read.materials)[index]
        known[1][index] = AreaLamp(name, (x, y, z), session.read.materials[index].emission, of=key)
    return known[1][index]


def duplicate(view: View, state: State, index: int) -> None:
    """The lamp of material ``index`` once more, beside itself."""
    scene, now = view.session.unedited, view.session.materials[index]
    corners = scene.corners[scene.material_ids == index].reshape(-1, 3)
    size = np.ptp(corners, axis=0)
    shift = np.where(np.arange(3) == np.argmax(size * (1, 0.5, 1)), 1.5 * size, 0.0)  # rather not upwards
    x, y, z = (middle_of(scene, index) + shift).tolist()
    name = free_name(view, scene.materials[index].name or "lamp")
    add(view, replace(lamp_of(view, state, index), name=name, position=(x, y, z), emission=now.emission))


def add(view: View, lamp: AreaLamp) -> None:
    """One more lamp."""
    now = view.session.asked_surfaces
    view.session.change_surfaces(replace(now, lamps=(*now.lamps, lamp)))


def remove(view: View, index: int) -> None:
    """Take the lamp of material ``index`` away, with its surfaces."""
    session, lamp = view.session, added_lamp(view, index)
    now = session.asked_surfaces
    if lamp is None:
        less = replace(now, removed=(*now.removed, keys_of(session.read.materials)[index]))
    else:
        less = replace(now, lamps=tuple(other for other in now.lamps if other.name != lamp.name))
    session.change_surfaces(less)


def put(view: View, index: int, lamp: AreaLamp) -> None:
    """Let the lamp of material ``index`` be as this one, see ``lamp_of``: of the scene's own only the position is heeded."""
    session = view.session
    now = session.asked_surfaces
    if index >= len(session.read.materials):
        lamps = tuple(lamp if other.name == lamp.name else other for other in now.lamps)
        changed = replace(now, lamps=lamps)
    else:
        key = keys_of(session.read.materials)[index]
        x, y, z = (np.array(lamp.position) - middle_of(session.read, index)).tolist()
        others = tuple(moved for moved in now.moved if moved.key != key)
        at_home = max(abs(x), abs(y), abs(z)) == 0.0
        changed = replace(now, moved=others if at_home else (*others, Moved(key, (x, y, z))))
    if changed != now:
        session.change_surfaces(changed)


def came_from(view: View, state: State, index: int) -> RGB:
    """Where the lamp of material ``index`` is in the file; of one that was added, where it is."""
    if index >= len(view.session.read.materials):
        return lamp_of(view, state, index).position
    return _home(view, state, index)[0]


def _home(view: View, state: State, index: int) -> tuple[RGB, bool]:
    """Where a lamp of the scene's own is in the file, and whether it is part of a larger piece there; looked up once."""
    read = view.session.read
    if state.homes[0] is not read:
        state.homes = read, {}
    known = state.homes[1]
    if index not in known:
        x, y, z = middle_of(read, index).tolist()
        known[index] = (x, y, z), hangs_together(read, index)
    return known[index]


def why_fixed(view: View) -> str | None:
    """Why the surfaces of the open scene cannot be changed now."""
    return LOADING if view.session.loading is not None else view.session.fixed


def why_not_moved(view: View, state: State, index: int) -> str | None:
    """Why the lamp of material ``index`` cannot be moved."""
    if index < len(view.session.read.materials) and _home(view, state, index)[1]:
        return JOINED
    return why_fixed(view)


def free_name(view: View, kind: str) -> str:
    """That no material has, nor one that may come back."""
    session = view.session
    names = [material.name for material in session.materials] + [name for name, _ in session.material_edits]
    return new_name(kind, names)


__all__ = [
    *(
        "add",
        "added_lamp",
        "came_from",
        "duplicate",
        "free_name",
        "lamp_of",
        "lamps",
        "put",
        "remove",
        "used_materials",
    ),
    *("why_fixed", "why_not_moved"),
]
