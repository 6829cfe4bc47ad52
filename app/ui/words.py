"""Words of the window: what a control does, as its tooltip says, and what messages say of flags of the command line."""

from __future__ import annotations

import functools
import re

from app.atlas.options import AtlasOptions
from app.lightmap.options import LightmapOptions
from app.options import Spec, specs
from app.render.options import DisplayOptions
from app.solvers import SOLVERS

FLAG = re.compile(r"(?<![\w-])--(?:no-)?([a-z][a-z-]*)")
PERCENT = re.compile(r"(?<=\d)%")
SOLVER = re.compile(r"--solver (\w+)")
PLACES = {
    "light": "Ceiling in the Lights panel",
    "sky": "Sky in the Lights panel",
    "sun": "the sun's place in the Lights panel",
}
BY_HAND = "Drag, with Shift finely; double-click: type a number"  # of a slider
LEAST, MOST = 1e-5, 1e8  # numbers beyond which a range has no end to speak of


def meaning(spec: Spec, off: str | None = None) -> str:
    """What a tooltip says of an option: what it does and costs, its range, default and the papers' word. off: why it has no
    effect now."""
    text = spec.tip or spec.help
    lines = [f"{text[:1].upper()}{text[1:]}.", _range(spec)]
    if spec.type in (int, float) and not spec.choices and off is None:
        lines.append(f"{BY_HAND}.")
    if spec.term:
        lines.append(f"In papers: {spec.term}.")
    if off is not None:
        lines.append(f"No effect now: {off}.")
    return "\n".join(lines)


def plain(text: str) -> str:
    """``text``, with the name that a control has instead of its flag, "--solver gathering" is Gathering, "--density" Density, and
    with numbers as they stand beside it: "2.10%" is 2.10 %."""
    text = PERCENT.sub(" %", text)
    text = SOLVER.sub(lambda found: SOLVERS[found[1]].title if found[1] in SOLVERS else found[0], text)
    return FLAG.sub(lambda found: PLACES.get(found[1]) or title(found[1].replace("-", "_")), text)


def title(name: str) -> str:
    """What the widget of an option is called: ``Patch level`` for level."""
    words = name.replace("_", " ")
    return _titles().get(name) or words[:1].upper() + words[1:]


def number(value: float) -> str:
    """Without an exponent, thousands apart: 0.001, 16,000,000."""
    text = f"{value:,.8f}".rstrip("0").rstrip(".") if isinstance(value, float) else f"{value:,}"
    return text.replace("-", "\N{MINUS SIGN}")


@functools.cache
def _titles() -> dict[str, str]:
    families = (family.options for family in SOLVERS.values())
    return {
        spec.name: spec.title
        for one in (AtlasOptions, LightmapOptions, DisplayOptions, *families)
        for spec in specs(one)
    }


def _range(spec: Spec) -> str:
    """Of legal values, and the default: ``0 to 4 (default 2)``."""
    unit = f" {spec.unit}" if spec.unit else ""
    if spec.type is bool:
        default = "on" if spec.default else "off"
    elif spec.default is None:
        default = "found from the scene"
    else:
        default = number(spec.default) + unit if spec.type in (int, float) else str(spec.default)
    default = f"default {spec.zero if spec.default == 0 and spec.zero else default}; right-click: back to it"
    if spec.choices or spec.minimum is None or spec.maximum is None:
        return f"{default[:1].upper()}{default[1:]}."
    steps = f" in steps of {spec.multiple}" if spec.multiple > 1 else ""
    low, high = spec.minimum, spec.maximum
    bounds = f"{number(low)} to {number(high)}{unit}"
    if 0 < low < LEAST:
        bounds = f"Above 0{unit}" if high > MOST else f"Up to {number(high)}{unit}"
    elif high > MOST:
        bounds = f"From {number(low)}{unit}"
    return f"{bounds}{steps}; {default}."


__all__ = ["BY_HAND", "meaning", "number", "plain", "title"]
