"""Inspect: the texel under the last click, what the last shooter saw, and the atlas."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from app.solvers import TREE
from app.ui import theme, widgets
from app.ui.panels import atlas
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.picking import Picked
    from app.session.session import Session

REFRESH_SECONDS = 0.25  # between two pictures of it


def draw(session: Session, state: State) -> None:
    """The whole panel."""
    if state.picked is None:
        widgets.wrapped("Click a surface to read its texel.", theme.DIM)
    else:
        if widgets.fold("Surface"):
            _surface(session, state.picked)
        if widgets.fold("Light [W/m²]"):
            _light(session, state.picked)
    if widgets.fold("What the last shooter saw"):
        _shooter(session, state)
    if widgets.fold("Atlas"):
        atlas.draw(session, state)


def _shooter(session: Session, state: State) -> None:
    image, vanished = _hemicube(session, state)
    if image is None or state.texture_id is None:
        return
    width = widgets.steady_width()
    imgui.image(
        imgui.ImTextureRef(state.texture_id(image)),
        imgui.ImVec2(width, width * image.size[1] / image.size[0]),
        imgui.ImVec2(0, 1),
        imgui.ImVec2(1, 0),
    )
    widgets.tooltip(f"What the patch that shot last sees, one colour per surface: {session.shooting.projection}")
    if vanished:
        widgets.facts("small", [("Smaller than a sample", f"{vanished:,} triangles")])
        widgets.tooltip("They lie between the samples of this map, and are drawn as one sample each")


def _hemicube(session: Session, state: State) -> tuple[Any, int]:
    """The picture of the last shot and the triangles that vanish in it, made anew a few times a second, and whenever the
    textures behind it may be others.
    """
    shooting = session.shooting.as_dict().items()
    source = session.lightmap, [value for name, value in shooting if name not in TREE]
    state.hemicube_age += imgui.get_io().delta_time
    if state.hemicube is None or state.hemicube[0] != source or state.hemicube_age >= REFRESH_SECONDS:
        state.hemicube, state.hemicube_age = (source, session.hemicube_image(), session.vanished()), 0.0
    return state.hemicube[1:]


def _surface(session: Session, picked: Picked) -> None:
    materials = session.scene.materials
    material = materials[picked.material].name if picked.material < len(materials) else str(picked.material)
    widgets.facts(
        "place",
        [
            ("Object", str(picked.object)),
            ("Material", material),
            ("Triangle", f"{picked.triangle}{' (back)' if picked.back else ''}, chart {picked.chart}"),
            ("Texel", f"{picked.texel[0]}, {picked.texel[1]} of facet {picked.facet}"),
            ("Patch", f"{picked.patch[0]}, {picked.patch[1]} of {picked.patch_edge}×{picked.patch_edge} texels"),
            ("Position [m]", widgets.triple(picked.position, 3)),
            ("Normal", widgets.triple(picked.normal, 3)),
            ("Area [m²]", widgets.number(picked.area)),
        ],
    )


def _light(session: Session, picked: Picked) -> None:
    right = session.reference_at(picked.texel) if picked.area > 0 else None
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
