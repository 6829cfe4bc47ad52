"""Scene: what was loaded, how large it is, and what was repaired or left out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui

from app.scene.load import NO_LIGHT
from app.ui import area_edits, theme, widgets
from app.ui.state import State
from app.ui.words import plain

if TYPE_CHECKING:
    from app.session.view import View


def draw(view: View, state: State) -> None:
    """The whole panel."""
    _counts(view, state)
    warnings = [warning for warning in view.session.warnings if warning != NO_LIGHT]  # the view says it, while it is so
    if warnings:
        widgets.section(f"{len(warnings)} warning{'s' * (len(warnings) > 1)}")
    for warning in warnings:
        widgets.wrapped(plain(warning), theme.AMBER)


def _counts(view: View, state: State) -> None:
    """A line for each, with its meaning where the pointer rests."""
    stats, session = state.stats, view.session
    assert stats is not None
    tile = session.charts.tile
    low, high = session.scene.bounds
    size = " × ".join(widgets.number(float(edge), 3) for edge in np.subtract(high, low))
    rows = (
        ("Name", session.name, "as the file has it"),
        ("Size [m]", size, "of the box around all surfaces: x, y, z, with y up"),
        ("Triangles", f"{stats.triangles:,}", "after repair, and cut where surfaces meet"),
        ("Materials", f"{len(area_edits.used_materials(view, state)):,}", "that are on a surface"),
        ("Charts", f"{stats.charts:,}", "pieces of surface that are unfolded into the plane as a whole"),
        ("Texels", f"{stats.texels:,}", "that cover a surface: each holds its own light"),
        ("Tiles", f"{stats.tiles:,}", f"squares of {tile}×{tile} texels, which quadtrees split"),
        ("Density", f"{widgets.short(session.charts.density)} texels/m", "texels along a metre of surface, aimed at"),
        ("Memory", f"{widgets.number(stats.memory_mib, 3)} MiB", "of the texels on the GPU"),
    )
    if not imgui.begin_table("counts", 2, imgui.TableFlags_.sizing_stretch_prop):
        return
    imgui.table_setup_column("label", imgui.TableColumnFlags_.width_stretch, widgets.LABEL_SHARE)
    imgui.table_setup_column("value", imgui.TableColumnFlags_.width_stretch, 1 - widgets.LABEL_SHARE)
    for label, value, meaning in rows:
        imgui.table_next_row()
        imgui.table_next_column()
        widgets.dim(label)
        widgets.tooltip(f"{label}: {meaning}")
        imgui.table_next_column()
        widgets.wrapped(value)
        widgets.copied_by_click(value)
    imgui.end_table()
