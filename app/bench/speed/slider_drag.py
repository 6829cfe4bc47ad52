"""A hand at the sliders of the quadtrees, for ``glowtree bench frames --drag``: back and forth, a little in each frame."""

from __future__ import annotations

from collections.abc import Iterator

from app.lightmap.options import LightmapOptions
from app.options import specs

SWEEP = 75  # frames from one end of a slider to the other
SWEEPS = 4
DECADES = 1.5  # that the gradient goes down from where it is
DEPTHS = (6, 2)
DRAGGED = ("gradient", "depth")


def drag(name: str, start: LightmapOptions) -> Iterator[LightmapOptions]:
    """What the panel hands over, frame by frame, while the slider of one of DRAGGED is moved: the gradient down from where it
    is, the depth between DEPTHS, and back."""
    least = {spec.name: spec.minimum or 0.0 for spec in specs(LightmapOptions)}["gradient"]
    for nth in range(1, SWEEPS * SWEEP + 1):
        sweep, step = divmod(nth, SWEEP)
        place = (step if sweep % 2 == 0 else SWEEP - step) / SWEEP
        if name == "gradient":
            yield start.replace(gradient=max(start.gradient * 10.0 ** (-DECADES * place), least))
        else:
            yield start.replace(depth=round(DEPTHS[0] + (DEPTHS[1] - DEPTHS[0]) * place))
