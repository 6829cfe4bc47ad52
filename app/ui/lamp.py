"""The light that a lamp gives, as it is edited: how much, in lumen or watts, its colour, and the colour's temperature."""

from __future__ import annotations

from collections.abc import Sequence

from imgui_bundle import imgui

from app.render.units import QUANTITIES, measure
from app.scene.colorimetry import COOLEST, HOTTEST, colour_of_kelvin, kelvin_of_colour
from app.ui import colour, slider, widgets
from app.ui.state import RGB

STRONGEST = 1e6  # W of each kind, end of the slider
KELVIN = slider.Range(COOLEST, HOTTEST, logarithmic=True)
WARM = 2700.0  # K, of a filament: where the slider begins for a colour that has no temperature
WHITE: RGB = (1.0, 1.0, 1.0)
HELP = {
    "seen": "How bright the lamp itself looks, whatever its size; it gives off π times that per m²",
    "directed": "How much goes into its main direction, per steradian",
    "arrives": "How much falls on a surface that faces it",
}


def edit_light(
    light: RGB,
    kind: str,
    quantities: str,
    *,
    came: RGB,
    tint: RGB = WHITE,
    weakest: float = 0.0,
    spread: float | None = None,
) -> tuple[RGB, RGB]:
    """The widgets of light (RGB, in W), which ``kind`` of QUANTITIES it is; the light and its colour afterwards.

    came: as the file has it, which a right click brings back. tint: its colour where there is no light. weakest: that the slider
    allows. spread: what all that it gives off is of it, where that is known [sr or m² sr].
    """
    tint, strength = colour.tint_and_strength(light, tint)
    known, name = QUANTITIES[quantities], QUANTITIES[quantities][kind].name
    widgets.labelled(name.split()[-1].capitalize(), changed=light != came)
    new_tint = colour.edit_tint("##colour", tint)
    back = widgets.put_back(False, True)
    imgui.same_line()
    new = _amount("##strength", strength, _per_strength(tint, quantities), known[kind].unit, weakest)
    back = widgets.put_back(back, True)
    widgets.tooltip(f"{name.capitalize()}. {HELP[kind]}. {widgets.SLIDES}")
    if spread is not None:
        widgets.labelled("Flux")
        whole = spread * (sum(tint) if quantities == "radiometric" else _per_strength(tint, quantities))
        new = _amount("##flux", new, whole, known["flows"].unit, weakest)
        back = widgets.put_back(back, True)
        widgets.tooltip(f"{known['flows'].name.capitalize()}: all that it gives off. {widgets.SLIDES}")
    new_tint = _temperature(new_tint, shines=strength > 0)
    if widgets.put_back(back, True):
        return came, colour.tint_and_strength(came, tint)[0]
    same = (new_tint, new) == (tint, strength)
    return (light if same else colour.rgb(new * c for c in new_tint)), new_tint


def _per_strength(tint: Sequence[float], quantities: str) -> float:
    """What a strength of 1 W of its brightest channel is counted as: in watts that channel is meant."""
    return 1.0 if quantities == "radiometric" else measure(tint, quantities)


def _amount(label: str, strength: float, factor: float, unit: str, weakest: float) -> float:
    """The strength after its product with a factor was edited."""
    factor = max(factor, 1e-30)
    imgui.set_next_item_width(-1)
    shown = factor * strength
    ends = slider.Range(factor * weakest, factor * STRONGEST, logarithmic=True, start=factor)
    edited = slider.slide(label, shown, ends, f"{widgets.number(shown)} {unit}" if strength else "off")
    return strength if edited == shown else edited / factor


def _temperature(tint: RGB, *, shines: bool) -> RGB:
    """The tint after its temperature was edited. shines: whether there is light that has one."""
    kelvin = kelvin_of_colour(tint) if shines else None
    widgets.labelled("Temperature")
    imgui.set_next_item_width(-1)
    shown = WARM if kelvin is None else kelvin
    imgui.begin_disabled(not shines)
    edited = slider.slide("##kelvin", shown, KELVIN, "none" if kelvin is None else f"{shown:,.0f} K")
    imgui.end_disabled()
    help = "Of a black body that has this colour: a candle 1,900 K, a filament 2,700 K, daylight 6,500 K"
    widgets.tooltip(f"{help}. {widgets.SLIDES}" if shines else f"{help}\nNo effect now: it gives no light")
    return tint if edited == shown else colour_of_kelvin(edited)
