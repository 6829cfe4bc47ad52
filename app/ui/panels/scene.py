"""Scene: what was loaded, and its materials, whose albedo and emission can be edited."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from app.lightmap.options import QUADTREE
from app.scene.model import MOST_ALBEDO
from app.ui import colour, theme, widgets
from app.ui.panels import lights, sky
from app.ui.state import RGB, State

if TYPE_CHECKING:
    from app.session.view import View

TALL_EM = 53.0  # a window in which the whole panel has room
ROWS_SHOWN = 5  # of the material list before it scrolls
WHITE = (1.0, 1.0, 1.0)
STRONGEST = 1e5  # W/(sr m²), end of the slider: the sun's disc is brighter, lamps are not


def draw(view: View, state: State) -> None:
    """The whole panel."""
    _statistics(view, state)
    widgets.section("Materials")
    _list(view, state)
    if state.material < len(view.session.materials):
        _editor(view, state, view.session.materials[state.material])
    if view.session.family.relights:
        _flicker(view, state)
    lights.draw(view, state)
    sky.draw(view, state)
    if widgets.fold("Texels", opened=has_room()):
        _atlas(view, state)


def has_room() -> bool:
    """Whether the window is so high that all of the panel can be shown."""
    return imgui.get_main_viewport().size.y > TALL_EM * imgui.get_font_size()


def _statistics(view: View, state: State) -> None:
    """Counts in two columns, and the warnings of loading."""
    stats = state.stats
    assert stats is not None
    tile = view.session.charts.tile
    counts = (
        ("Triangles", f"{stats.triangles:,}", "after repair"),
        ("Charts", f"{stats.charts:,}", "pieces of surface that unfold together"),
        ("Texels", f"{stats.texels:,}", "that cover a surface"),
        ("Tiles", f"{stats.tiles:,}", f"of {tile}×{tile} texels"),
        ("Density", f"{widgets.number(view.session.charts.density, 3)}/m", "texels per metre that was aimed at"),
        ("Memory", f"{widgets.number(stats.memory_mib, 3)} MiB", "of the texels on the GPU"),
    )
    if imgui.begin_table("statistics", 4, imgui.TableFlags_.sizing_stretch_prop):
        for label, value, meaning in counts:
            imgui.table_next_column()
            widgets.dim(label)
            widgets.tooltip(f"{label}: {meaning}")
            imgui.table_next_column()
            imgui.text_unformatted(value)
        imgui.end_table()
    warnings = (*view.session.scene.warnings, *view.session.charts.warnings)
    if warnings and imgui.tree_node(f"{len(warnings)} warning{'s' * (len(warnings) > 1)}###warnings"):
        for warning in warnings:
            widgets.wrapped(warning, theme.AMBER)
        imgui.tree_pop()


def _atlas(view: View, state: State) -> None:
    """How finely surfaces are cut; takes hold with the button, since it takes a while. The draft stays until then."""
    session = view.session
    atlas = session.atlas if state.atlas is None else state.atlas
    light = session.light if state.adaptive is None else session.light.replace(adaptive=state.adaptive)
    assert state.stats is not None
    starts = {"density": float(session.charts.density), "texels": state.stats.texels}
    atlas = state.atlas = widgets.edit_options(atlas, starts=starts)
    light = widgets.edit_options(light, skip=("storage", *QUADTREE))
    state.adaptive = light.adaptive
    if (atlas, light) != (session.atlas, session.light):
        imgui.begin_disabled(session.loading is not None)
        if imgui.button("Cut anew", imgui.ImVec2(-1, 0)):
            state.act(lambda: session.cut_anew(atlas, adaptive=light.adaptive))
        imgui.end_disabled()


def _list(view: View, state: State) -> None:
    materials = view.session.materials
    height = min(len(materials), ROWS_SHOWN) * imgui.get_text_line_height_with_spacing()
    imgui.begin_child("materials", imgui.ImVec2(0, height))
    clipper = imgui.ListClipper()
    clipper.begin(len(materials))
    while clipper.step():
        for index in range(clipper.display_start, clipper.display_end):
            _row(state, index, materials[index])
    imgui.end_child()


def _row(state: State, index: int, material: Any) -> None:
    imgui.push_id(index)
    side = imgui.get_text_line_height()
    colour.swatch("##albedo", material.albedo, side)
    imgui.same_line()
    if imgui.selectable(material.name or f"material {index}", state.material == index)[0]:
        state.material = index
    if material.emits:
        imgui.same_line(imgui.get_content_region_avail().x - side)
        imgui.text_colored(imgui.ImVec4(*theme.AMBER), theme.ICONS.ICON_FA_LIGHTBULB)
        widgets.tooltip("emits light")
    imgui.pop_id()


def _editor(view: View, state: State, material: Any) -> None:
    index = state.material
    imgui.push_id("material")
    edited = dataclasses.replace(material, albedo=_albedo(material), emission=_emission(state, material))
    imgui.pop_id()
    if (edited.albedo, edited.emission) != (material.albedo, material.emission):
        state.act(lambda: view.session.set_material(index, edited))
    notes = [f"{word} texture" for word in ("albedo", "emission") if getattr(material, f"{word}_texture") is not None]
    if material.double_sided:
        notes.append("both sides")
    if notes:
        widgets.dim(", ".join(notes))


def _flicker(view: View, state: State) -> None:
    """Whether all lamps change from frame to frame."""
    widgets.labelled("Lamps flicker")
    changed, on = imgui.checkbox("##flicker", view.session.flickers)
    widgets.tooltip("Each lamp gives a quarter more or less, a few times a second; off, all are as they were edited")
    if changed:
        state.act(lambda: view.session.set_flicker(on))


def _albedo(material: Any) -> RGB:
    widgets.labelled("Albedo ρ")
    imgui.set_next_item_width(-1)
    edited = colour.edit_colour("##albedo", material.albedo, code=True, most=MOST_ALBEDO)
    widgets.tooltip(
        f"The share of light that it reflects: ρ {widgets.triple(material.albedo, 3)} of red, green, blue. The code is of what "
        "the screen shows (sRGB), as everywhere"
    )
    return edited


def _emission(state: State, material: Any) -> RGB:
    """Colour × strength. A lamp that is dimmed to nothing keeps its colour in the state."""
    tint, strength = colour.tint_and_strength(material.emission, state.emission_colours.get(state.material, WHITE))
    widgets.labelled("Emission L")
    new_tint = state.emission_colours[state.material] = colour.edit_tint("##emission", tint)
    imgui.same_line()
    imgui.set_next_item_width(-1)
    flags = widgets.SLIDER | widgets.LOGARITHMIC
    scaled, new_strength = imgui.slider_float("##strength", strength, 0.0, STRONGEST, "%.4g W/(sr m²)", flags)
    widgets.tooltip("Radiance: colour times strength. Exitance is π times this. Right-click: off")
    if imgui.is_item_hovered() and imgui.is_mouse_clicked(1):
        scaled, new_strength = True, 0.0
    if (new_tint == tint and not scaled) or new_strength != new_strength:
        return material.emission
    return colour.rgb(v * new_strength for v in new_tint)
