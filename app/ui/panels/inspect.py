"""Inspect: the texel under the last click, what the last shooter saw, and the atlas."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from app.ui import theme, widgets
from app.ui.panels import atlas
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.picking import Picked
    from app.session.view import View

REFRESH_SECONDS = 0.25  # between two pictures of it


def draw(view: View, state: State) -> None:
    """The whole panel."""
    if state.picked is None:
        widgets.wrapped("Click a surface to read its texel.", theme.DIM)
    else:
        if widgets.fold("Surface"):
            _surface(view, state.picked)
        if widgets.fold("Light [W/m²]"):
            _light(view, state.picked)
    _solver(view, state)
    if widgets.fold("Atlas"):
        atlas.draw(view, state)


def _solver(view: View, state: State) -> None:
    """What the solver shows of its last work: a fold for each of its pictures, with what there is to say below the first."""
    state.inspected_age += imgui.get_io().delta_time
    for nth, (caption, meaning) in enumerate(view.session.family.pictures.items()):
        if not widgets.fold(caption):
            continue
        inspection = _inspection(view, state)
        image = inspection.images.get(caption)
        if image is None or state.texture_id is None:
            continue
        width = widgets.steady_width()
        imgui.image(
            imgui.ImTextureRef(state.texture_id(image)),
            imgui.ImVec2(width, width * image.size[1] / image.size[0]),
            imgui.ImVec2(0, 1),
            imgui.ImVec2(1, 0),
        )
        widgets.tooltip(meaning)
        if nth == 0:
            widgets.facts("solver", list(inspection.facts.items()))


def _inspection(view: View, state: State) -> Any:
    """With pictures, made anew a few times a second, and whenever the textures behind them may be others."""
    session = view.session
    source = session.lightmap, session.solver, session.options
    if state.inspected is None or state.inspected[0] != source or state.inspected_age >= REFRESH_SECONDS:
        state.inspected, state.inspected_age = (source, session.solver.inspect(images=True)), 0.0
    return state.inspected[1]


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
        ("B", picked.B, "radiosity: all light that leaves"),
        ("E", picked.E, "exitance of its own"),
        ("H", picked.H, "irradiance: light received"),
        *([] if right is None else [("R", right, "irradiance of the reference")]),
        ("r", picked.r, "residual: not yet shot"),
        ("ρ", picked.albedo, "albedo"),
    )
    if not imgui.begin_table("light", 4, imgui.TableFlags_.sizing_stretch_prop):
        return
    imgui.table_setup_column("", imgui.TableColumnFlags_.width_fixed, imgui.get_font_size())
    for channel in ("red", "green", "blue"):
        imgui.table_setup_column(channel)
    imgui.table_headers_row()
    for symbol, values, meaning in rows:
        imgui.table_next_row()
        imgui.table_next_column()
        imgui.text_colored(imgui.ImVec4(*theme.AMBER), symbol)
        widgets.tooltip(meaning)
        for value in values:
            imgui.table_next_column()
            imgui.text_unformatted(widgets.number(float(value)))
    imgui.end_table()
