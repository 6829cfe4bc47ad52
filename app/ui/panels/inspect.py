"""Inspect: the texel under the last click with its hemisphere, what the solver shows of its work, and the atlas."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from imgui_bundle import imgui

from app.render.ray_picture import LINES
from app.render.units import QUANTITIES, measure
from app.solvers import HEMISPHERE
from app.ui import theme, widgets
from app.ui.colour import rgb
from app.ui.panels import atlas
from app.ui.state import RGB, State

if TYPE_CHECKING:
    from app.session.picking import Picked
    from app.session.view import View

REFRESH_SECONDS = 0.25  # between two pictures of it
DISC_SHARE = 0.58  # of the panel's width
SYMBOL_EM = 1.0, 1.4  # width of the column of symbols, without and with indices


def draw(view: View, state: State) -> None:
    """The whole panel."""
    state.inspected_age += imgui.get_io().delta_time
    if state.picked is None:
        widgets.wrapped("Click a surface to read its texel.", theme.DIM)
    else:
        _hemisphere(view, state)
        if widgets.fold("Surface"):
            _surface(view, state.picked)
        if widgets.fold("Light [W/m²]" if view.display.quantities == "radiometric" else "Light"):
            _light(view, state.picked)
    _solver(view, state)
    if widgets.fold("Atlas"):
        atlas.draw(view, state)


def _hemisphere(view: View, state: State) -> None:
    """What the rays of the picked texel bring, where the solver has any; beside it, whether they are drawn in the room."""
    meaning = view.session.family.pictures.get(HEMISPHERE)
    if meaning is None or _texel(state) is None or not widgets.fold(HEMISPHERE):
        return
    _picture(view, state, HEMISPHERE, meaning, widgets.steady_width() * DISC_SHARE)
    imgui.same_line()
    imgui.begin_group()
    state.draw_rays = imgui.checkbox("Rays in\nthe room", state.draw_rays)[1]
    widgets.tooltip(f"Draw the first {LINES} rays of the picked texel, each in the light that it brings")
    imgui.end_group()


def _solver(view: View, state: State) -> None:
    """What the solver shows of its last work: a fold for each of its pictures, with what there is to say below the first."""
    captions = [caption for caption in view.session.family.pictures if caption != HEMISPHERE]
    for caption in captions:
        if widgets.fold(caption) and _picture(
            view, state, caption, view.session.family.pictures[caption], widgets.steady_width()
        ):
            if caption == captions[0]:
                widgets.facts("solver", list(_inspection(view, state).facts.items()))


def _picture(view: View, state: State, caption: str, meaning: str, width: float) -> bool:
    """One of the solver's, if there is one now."""
    image = _inspection(view, state).images.get(caption)
    if image is None or state.texture_id is None:
        return False
    height = width * image.size[1] / image.size[0]
    texture = imgui.ImTextureRef(state.texture_id(image))
    imgui.image(texture, imgui.ImVec2(width, height), imgui.ImVec2(0, 1), imgui.ImVec2(1, 0))
    widgets.tooltip(meaning)
    return True


def _inspection(view: View, state: State) -> Any:
    """With pictures, made anew a few times a second while light moves, of coarse light once it rests, and whenever the textures
    behind them may be others."""
    session, texel = view.session, _texel(state)
    source = session.lightmap, session.solver, session.options, texel, view.display
    light, known = (session.state, session.run.progress.done), state.inspected
    waits = state.inspected_age < REFRESH_SECONDS or (session.coarse and session.solving)
    if known is None or known[0] != source or (known[1] != light and not waits):
        known, state.inspected_age = (source, light, view.inspect(texel)), 0.0
        state.inspected = known
    return known[2]


def _texel(state: State) -> tuple[int, int] | None:
    """The one that was picked, if its side has texels."""
    return state.picked.texel if state.picked is not None and state.picked.area > 0 else None


def _surface(view: View, picked: Picked) -> None:
    materials = view.session.scene.materials
    material = materials[picked.material].name if picked.material < len(materials) else str(picked.material)
    widgets.facts(
        "place",
        [
            ("Object", str(picked.object)),
            ("Material", material),
            ("Triangle", f"{picked.triangle}{' (back)' if picked.back else ''}, chart {picked.chart}"),
            ("Texel", f"{picked.texel[0]}, {picked.texel[1]} of facet {picked.facet}"),
            *picked.facts.items(),
            ("Position [m]", widgets.triple(picked.position, 3)),
            ("Normal", widgets.triple(picked.normal, 3)),
            ("Area [m²]", widgets.number(picked.area)),
        ],
    )


def _light(view: View, picked: Picked) -> None:
    right = view.session.compared.irradiance_at(picked.texel) if picked.area > 0 else None
    rows = (
        Row("B", "leaves", picked.B, "All light that leaves"),
        Row("E", "leaves", picked.E, "Light of its own"),
        Row("H", "arrives", picked.H, "Light received"),
        *(
            Row(f"H{name[0]}", "arrives", part, f"The {name} part of light received")
            for name, part in picked.parts.items()
        ),
        *([] if right is None else [Row("R", "arrives", right, "Light received by the reference")]),
        *([Row("r", "leaves", picked.r, "Not yet shot")] if "residual" in view.session.family.layers else []),
        Row("ρ", "", picked.albedo, "Albedo: the share of light that it reflects"),
    )
    if view.display.quantities == "radiometric":
        _channels(rows, wide=bool(picked.parts))
    else:
        _amounts(
            (Row("L", "seen", rgb(b / math.pi for b in picked.B), "How bright it looks"), *rows),
            wide=bool(picked.parts),
        )


class Row(NamedTuple):
    """Of light: symbol, which of QUANTITIES it is, value in W, and meaning."""

    symbol: str
    what: str
    value: RGB
    meaning: str


def _channels(rows: tuple[Row, ...], *, wide: bool) -> None:
    """Red, green and blue of each, in W/m². wide: symbols have indices."""
    if not _table(("red", "green", "blue"), wide=wide):
        return
    imgui.table_headers_row()
    for row in rows:
        _symbol(row)
        for value in row.value:
            imgui.table_next_column()
            _value(widgets.number(float(value)))
    imgui.end_table()


def _amounts(rows: tuple[Row, ...], *, wide: bool) -> None:
    """One number of each, and its unit; of an albedo the share of white light."""
    if not _table(("value", "unit"), wide=wide):
        return
    for row in rows:
        _symbol(row)
        imgui.table_next_column()
        text, unit = widgets.percent(measure(row.value, "radiometric")), ""
        if row.what:
            text, unit = widgets.number(measure(row.value, "photometric")), QUANTITIES["photometric"][row.what].unit
        _value(text, f"{text} {unit}".strip())
        imgui.table_next_column()
        widgets.dim(unit)
    imgui.end_table()


def _table(columns: tuple[str, ...], *, wide: bool) -> bool:
    if not imgui.begin_table("light", 1 + len(columns), imgui.TableFlags_.sizing_stretch_prop):
        return False
    imgui.table_setup_column("", imgui.TableColumnFlags_.width_fixed, imgui.get_font_size() * SYMBOL_EM[wide])
    for column in columns:
        imgui.table_setup_column(column)
    return True


def _symbol(row: Row) -> None:
    imgui.table_next_row()
    imgui.table_next_column()
    imgui.text_colored(imgui.ImVec4(*theme.AMBER), row.symbol)
    widgets.tooltip(row.meaning)


def _value(text: str, copied: str = "") -> None:
    imgui.text_unformatted(text)
    widgets.copied_by_click(copied or text)
