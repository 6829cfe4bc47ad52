"""Inspect: the texel under the last click, what the last shooter saw, and the atlas."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from app.render.ray_picture import LINES
from app.solvers import HEMISPHERE
from app.ui import theme, widgets
from app.ui.panels import atlas
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.picking import Picked
    from app.session.view import View

REFRESH_SECONDS = 0.25  # between two pictures of it
DISC_SHARE = 0.8  # of the panel's width
SYMBOL_EM = 1.0, 1.4  # width of the column of symbols, without and with indices


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
    """What the solver shows of its last work and of the picked texel: a fold for each of its pictures, with what there is to say
    below the first."""
    state.inspected_age += imgui.get_io().delta_time
    for nth, (caption, meaning) in enumerate(view.session.family.pictures.items()):
        of_texel = caption == HEMISPHERE
        if (of_texel and _texel(state) is None) or not widgets.fold(caption):
            continue
        inspection = _inspection(view, state)
        if of_texel:
            widgets.labelled("Rays in the room")
            state.draw_rays = imgui.checkbox("##rays", state.draw_rays)[1]
            widgets.tooltip(f"Draw the first {LINES} rays of the picked texel, each in the light that it brings")
        image = inspection.images.get(caption)
        if image is None or state.texture_id is None:
            continue
        width = widgets.steady_width() * (DISC_SHARE if of_texel else 1.0)
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
    session, texel = view.session, _texel(state)
    source = session.lightmap, session.solver, session.options, texel, view.display
    if state.inspected is None or state.inspected[0] != source or state.inspected_age >= REFRESH_SECONDS:
        state.inspected, state.inspected_age = (source, view.inspect(texel)), 0.0
    return state.inspected[1]


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
        ("B", picked.B, "radiosity: all light that leaves"),
        ("E", picked.E, "exitance of its own"),
        ("H", picked.H, "irradiance: light received"),
        *((f"H{name[0]}", part, f"the {name} part of it") for name, part in picked.parts.items()),
        *([] if right is None else [("R", right, "irradiance of the reference")]),
        *([("r", picked.r, "residual: not yet shot")] if "residual" in view.session.family.layers else []),
        ("ρ", picked.albedo, "albedo"),
    )
    if not imgui.begin_table("light", 4, imgui.TableFlags_.sizing_stretch_prop):
        return
    imgui.table_setup_column(
        "", imgui.TableColumnFlags_.width_fixed, imgui.get_font_size() * SYMBOL_EM[bool(picked.parts)]
    )
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
