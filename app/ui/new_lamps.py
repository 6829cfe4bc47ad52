"""New lamps: a button for each kind, in the Lights panel, and over the view of a scene that nothing lights."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui

from app.scene.area_lamps import AreaLamp
from app.scene.ceiling_light import MEAN_IRRADIANCE, ceiling_light
from app.scene.lamp_surfaces import new_name
from app.scene.lights import Light
from app.scene.model import RGB
from app.scene.sky import DEFAULT_SUN, SUN_ANGLE, Sky, Sun
from app.ui import area_edits, theme, widgets
from app.ui.state import State

if TYPE_CHECKING:
    from app.scene.model import F64
    from app.session.view import View

ICONS = theme.ICONS
PER_ROW = 3
EDGE = 0.1  # of a rectangle, of the scene's diagonal
GAP = 1e-3  # in front of the surface that it is put on, of the same
NEARER = 0.5  # of the way to what is looked at, where a point or spot light is put
DARK = "Nothing emits light"


@dataclass(frozen=True)
class Kind:
    """A button. surface: whether it adds a lamp with area, which is one."""

    label: str
    icon: str
    meaning: str
    add: Callable[[View, State], None]
    surface: bool = False


def buttons(view: View, state: State) -> None:
    """One for each kind, three in a row."""
    gap = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - (PER_ROW - 1) * gap) / PER_ROW
    for number, kind in enumerate(KINDS):
        if number % PER_ROW:
            imgui.same_line()
        off = why_not(view, kind)
        imgui.begin_disabled(off is not None)
        if imgui.button(f"{kind.icon} {kind.label}###add {kind.label}", imgui.ImVec2(width, 0)):
            state.act(functools.partial(kind.add, view, state))
        imgui.end_disabled()
        widgets.tooltip(kind.meaning + ("" if off is None else f"\nNot now: {off}"))


def is_lit(view: View, state: State) -> bool:
    """Whether anything shines in the open scene, as it was edited."""
    scene = view.session.edited_scene
    shines = any(scene.materials[index].emits for index in area_edits.used_materials(view, state))
    return shines or scene.lit_by_sky or scene.lit_by_lights


def dark_in_words(view: View) -> str:
    """Of a scene in which nothing shines, and how it is shown."""
    return f"{DARK}, shown unlit" if view.shown.plain else DARK


def why_not(view: View, kind: Kind) -> str | None:
    """Why a lamp of that kind cannot be added now."""
    session = view.session
    if kind.surface:
        return area_edits.why_fixed(view)
    return "there is a sky, see below" if kind.label == "Sky" and session.edited_scene.sky is not None else None


def pair_of_buttons(off: str | None = None) -> tuple[bool, bool]:
    """Duplicate and Remove, side by side; whether each was pressed. off: why they cannot be now."""
    width = (imgui.get_content_region_avail().x - imgui.get_style().item_spacing.x) / 2
    imgui.begin_disabled(off is not None)
    duplicate = imgui.button(f"{ICONS.ICON_FA_CLONE} Duplicate", imgui.ImVec2(width, 0))
    imgui.same_line()
    remove = imgui.button(f"{ICONS.ICON_FA_TRASH} Remove", imgui.ImVec2(width, 0))
    imgui.end_disabled()
    if off is not None:
        widgets.tooltip(f"Not now: {off}")
    return duplicate, remove


def light_beside(view: View, light: Light, size: float) -> Light:
    """The same lamp once more, a little beside it. size: diagonal of the scene [m]."""
    name = new_name(light.kind, [other.name for other in view.session.edited_scene.lights])
    x, y, z = light.position
    return replace(light, name=name, position=light.position if light.from_afar else (x + EDGE * size / 2, y, z))


def add_light(view: View, light: Light, state: State) -> None:
    """One more lamp without area: it is selected."""
    lights = view.session.edited_scene.lights
    _let_shine(view, lambda: view.session.set_lights((*lights, light)))
    state.light = len(lights)


def _point(view: View, state: State) -> None:
    place, _, strength = _in_view(view, state)
    add_light(view, Light(_light_name(view, "point"), "point", strength, place), state)


def _spot(view: View, state: State) -> None:
    place, towards, strength = _in_view(view, state)
    add_light(view, Light(_light_name(view, "spot"), "spot", strength, place, towards), state)


def _sun(view: View, state: State) -> None:
    x, y, z = (-DEFAULT_SUN.direction).tolist()
    red, green, blue = Sky(sun=DEFAULT_SUN).sun_irradiance.tolist()
    name = _light_name(view, "sun")
    add_light(view, Light(name, "directional", (red, green, blue), direction=(x, y, z), angle=SUN_ANGLE), state)


def _sky(view: View, state: State) -> None:
    sky = Sky("clear", sun=Sun(DEFAULT_SUN.azimuth, DEFAULT_SUN.height))
    _let_shine(view, lambda: view.session.set_sky(sky))


def _ceiling(view: View, state: State) -> None:
    area_edits.add(view, ceiling_light(view.session.unedited, area_edits.free_name(view, "ceiling light")))


def _area(view: View, state: State) -> None:
    """A square on the picked surface, or on what is in the middle of the view; its light falls on the ground plan as that of a
    ceiling light does."""
    low, high = view.session.unedited.bounds
    size = float(np.linalg.norm(high - low))
    edge = EDGE * size
    point, normal = _surface(view, state)
    if normal is None:
        point, normal = point - edge * view.camera.forward, -view.camera.forward
    across = np.cross((0.0, 1.0, 0.0) if abs(normal[1]) < 0.9 else (1.0, 0.0, 0.0), normal)
    L = MEAN_IRRADIANCE * max(float((high - low)[0] * (high - low)[2]), edge**2) / (math.pi * edge**2)
    name, middle = area_edits.free_name(view, "area light"), point + GAP * size * normal
    area_edits.add(view, AreaLamp(name, _triple(middle), (L, L, L), (edge, edge), _unit(normal), _unit(across)))


def _triple(vector: F64) -> RGB:
    x, y, z = np.asarray(vector, np.float64).tolist()
    return x, y, z


def _unit(vector: F64) -> RGB:
    return _triple(np.asarray(vector, np.float64) / np.linalg.norm(vector))


def _let_shine(view: View, edit: Callable[[], None]) -> None:
    """Make an edit; where nothing shone before, expose for its light."""
    dark = not view.session.edited_scene.emits
    edit()
    if dark:
        view.expose_for_light_to_come()


def _in_view(view: View, state: State) -> tuple[RGB, RGB, RGB]:
    """Where a lamp stands that lights what is looked at: its place, the direction there, and the intensity that brings
    MEAN_IRRADIANCE to it."""
    there, _ = _surface(view, state)
    way = there - view.camera.eye
    place = view.camera.eye + NEARER * way
    left = float(np.linalg.norm(there - place))
    x, y, z = place.tolist()
    u, v, w = ((there - place) / max(left, 1e-30)).tolist()
    strength = MEAN_IRRADIANCE * left**2
    return (x, y, z), (u, v, w), (strength, strength, strength)


def _surface(view: View, state: State) -> tuple[F64, F64 | None]:
    """The picked point, or that in the middle of the view, and its normal; without any the point that the eye turns around."""
    _, _, width, height = (int(v * state.ratio) for v in state.view_px)
    picked = state.picked or view.pick(width // 2, height // 2)
    if picked is None:
        return view.camera.target, None
    return np.array(picked.position), np.array(picked.normal)


def _light_name(view: View, kind: str) -> str:
    return new_name(kind, [light.name for light in view.session.edited_scene.lights])


KINDS = (
    Kind(
        "Ceiling",
        ICONS.ICON_FA_SQUARE,
        "An area light under the ceiling of the room that the camera looks at. All surfaces are cut anew in the background",
        _ceiling,
        surface=True,
    ),
    Kind(
        "Area",
        ICONS.ICON_FA_VECTOR_SQUARE,
        "A square of light on the picked surface, else on what is in the middle of the view. All surfaces are cut anew in the "
        "background",
        _area,
        surface=True,
    ),
    Kind(
        "Point",
        ICONS.ICON_FA_LIGHTBULB,
        "A light without area, half-way to what is picked or looked at, that shines to all sides; drag its handle",
        _point,
    ),
    Kind(
        "Spot",
        ICONS.ICON_FA_BULLSEYE,
        "A light without area, half-way to what is picked or looked at, that shines there in a cone",
        _spot,
    ),
    Kind(
        "Sun",
        ICONS.ICON_FA_SUN,
        "Light from one direction, as strong as the sun through clear air, for scenes that are open to it",
        _sun,
    ),
    Kind(
        "Sky",
        ICONS.ICON_FA_CLOUD_SUN,
        "A clear sky and its sun around the scene: it lights what is open to it",
        _sky,
    ),
)

__all__ = [
    "DARK",
    "KINDS",
    "add_light",
    "buttons",
    "dark_in_words",
    "is_lit",
    "light_beside",
    "pair_of_buttons",
    "why_not",
]
