"""Compare: a reference, how far the solution is from it, and how both are shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.ui import theme, widgets
from app.ui.state import State

if TYPE_CHECKING:
    from app.compare.comparison import Comparison
    from app.session.view import View

ICONS = theme.ICONS
VIEWS = ("solution", "reference", "split", "error")
MEANINGS = {
    "solution": "The light that is being solved: C shows the one or the other",
    "reference": "The light of the reference: C shows the one or the other",
    "split": "The solution left of the line, the reference right of it; drag the line: V",
    "error": "How far the irradiance of each texel is from the reference, over the reference: X",
}
EXPECTED = (
    "Of irradiance, with no reference: what random points of the surfaces receive of all that they see now, gathered "
    "along rays, against what the texels have there, and what comes back of the difference"
)
FINER = (
    "The scene as it is now is solved once more, with more texels and further, in a process of its own. That shows what texels, "
    "patches and unshot light cost; an error of the method itself is in both."
)


def draw(view: View, state: State) -> None:
    """The whole panel."""
    comparison = view.session.compared.comparison
    if widgets.fold("Expected error"):
        _expected(view)
    if comparison is None:
        widgets.wrapped("A reference is a bake of this scene, or a finer solve of it.", theme.DIM)
    else:
        _views(view, state)
        if widgets.fold("Error"):
            _error(view, comparison)
    if widgets.fold("Reference"):
        _reference(view, state)
    if widgets.fold("Solve one"):
        _solve(view, state)


def shown(view: View) -> str:
    """Which of VIEWS it is."""
    display = view.shown
    return "error" if display.layer == "error" else display.show


def show(view: View, state: State, what: str) -> None:
    """One of VIEWS; without a reference a line that says so."""
    if view.session.compared.comparison is None:
        state.notify("no reference yet: the Compare panel opens or solves one", error=True)
        return
    display = view.display
    if what == "error":
        state.layer = display.layer
        view.display = display.replace(layer="error")
    else:
        layer = state.layer if display.layer == "error" else display.layer
        view.display = display.replace(layer=layer, show=what)


def _views(view: View, state: State) -> None:
    """One button for each, side by side."""
    now, gap = shown(view), imgui.get_style().item_spacing.x
    texts = [imgui.calc_text_size(what.capitalize()).x for what in VIEWS]
    rest = (imgui.get_content_region_avail().x - (len(VIEWS) - 1) * gap - sum(texts)) / len(VIEWS)
    for what, text in zip(VIEWS, texts, strict=True):
        if what != VIEWS[0]:
            imgui.same_line()
        imgui.push_style_color(imgui.Col_.text, imgui.ImVec4(*(theme.AMBER if what == now else theme.TEXT)))
        if imgui.button(what.capitalize(), imgui.ImVec2(text + rest, 0)):
            show(view, state, what)
        imgui.pop_style_color()
        widgets.tooltip(MEANINGS[what])


def _expected(view: View) -> None:
    """What the solution says of itself, once light is at rest."""
    error = view.session.expected
    if error is not None:
        widgets.facts("expected", [("RMS", widgets.percent(error.rms)), ("Median", widgets.percent(error.median))])
    elif view.session.at_rest:
        widgets.dim("nothing is lit" if view.session.run.converged else "no light yet")
    elif view.session.estimate.share > 0:
        imgui.progress_bar(view.session.estimate.share, imgui.ImVec2(-1, 0), "")
    else:
        widgets.dim("known when solving pauses or ends")
    widgets.tooltip(EXPECTED)


def _error(view: View, comparison: Comparison) -> None:
    error = comparison.error
    if error is None:
        widgets.dim("measuring")
        return
    widgets.facts(
        "error",
        [
            ("RMS", widgets.percent(error.rms)),
            ("Median", widgets.percent(error.median)),
            ("90 % below", widgets.percent(error.q90)),
            ("Bias", f"{'+' if error.bias > 0 else ''}{widgets.percent(error.bias)}"),
        ],
    )
    widgets.tooltip(
        f"Of irradiance, at {comparison.lit:,} random points that are lit in the reference. RMS over the mean; median and 90 % "
        "of the errors over the reference at each point; bias of the mean"
    )
    for note in comparison.notes(view.session.lightmap):
        widgets.wrapped(note, theme.AMBER)


def _reference(view: View, state: State) -> None:
    """What it is, where there is one, and where it comes from."""
    comparison = view.session.compared.comparison
    if comparison is not None:
        light = comparison.light
        texels = "unknown" if light.texels is None else f"{light.texels:,}"
        rest = "unknown" if light.unshot is None else widgets.percent(light.unshot)
        widgets.facts("reference", [("From", light.name), ("Texels", texels), ("Unshot", rest)])
    width = (imgui.get_content_region_avail().x - imgui.get_style().item_spacing.x) / 2
    if imgui.button(f"{ICONS.ICON_FA_FOLDER_OPEN} Open a bake ...", imgui.ImVec2(width, 0)):
        state.ask_for_reference = True
    widgets.tooltip("A bake of this scene, its irradiance.exr, which can be dropped on the window, too")
    imgui.same_line()
    imgui.begin_disabled(comparison is None)
    if imgui.button("Forget", imgui.ImVec2(width, 0)):
        state.act(view.drop_reference)
    imgui.end_disabled()


def _solve(view: View, state: State) -> None:
    """The knobs of a solve in the background, or how far it is."""
    fetching = view.session.compared.fetching
    if fetching is None:
        state.reference = widgets.edit_options(
            state.reference, starts={"texels": view.session.compared.reference_texels}
        )
        if imgui.button("Solve in the background", imgui.ImVec2(-1, 0)):
            state.act(lambda: view.session.compared.solve(state.reference, view.session.edited_scene))
        widgets.tooltip(FINER)
        return
    imgui.progress_bar(fetching.fraction, imgui.ImVec2(-1, 0), "")
    widgets.wrapped(fetching.stage, theme.DIM)
    if imgui.button("Stop", imgui.ImVec2(-1, 0)):
        state.act(view.session.compared.stop_fetching)
