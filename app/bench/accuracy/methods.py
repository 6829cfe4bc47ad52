"""What ``glowtree bench error`` compares: the solvers, and one choice at a time besides the default."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from app.atlas.options import AtlasOptions
from app.atlas.parametrize import ROOT_SHARE
from app.lightmap.options import LightmapOptions
from app.solvers import ShootingOptions


@dataclass(frozen=True)
class Method:
    """axis: what is chosen. adaptive: whether the lightmap is. shooting, light: options that differ from those that were asked
    for."""

    axis: str
    adaptive: bool = False
    shooting: Mapping[str, Any] = field(default_factory=dict)
    light: Mapping[str, Any] = field(default_factory=dict)

    def options(
        self, texels: int | None, light: LightmapOptions, shooting: ShootingOptions
    ) -> tuple[AtlasOptions, LightmapOptions, ShootingOptions]:
        """texels: uniform ones; quadtrees begin with a sixteenth, so that some of their leaves become as fine or finer."""
        if self.adaptive and texels is not None:
            texels = max(texels // ROOT_SHARE, 1)
        held = light.replace(adaptive=self.adaptive, **self.light)
        return AtlasOptions(texels=texels), held, shooting.replace(**self.shooting)


METHODS = {
    "uniform": Method("solver"),
    "adaptive": Method("solver", adaptive=True),
    "disc": Method("form factor", shooting={"form_factor": "disc"}),
    "item-id": Method("visibility", shooting={"visibility": "item-id"}),
    "depth": Method("visibility", shooting={"visibility": "depth"}),
    "stereographic": Method("projection", shooting={"projection": "stereographic"}),
    "nonlinear": Method("projection", shooting={"projection": "nonlinear"}),
    "rgba16f": Method("storage", light={"storage": "rgba16f"}),
    "fixed8": Method("storage", light={"storage": "fixed8"}),
    "level-1": Method("shooting level", shooting={"level": 1}),
    "level-3": Method("shooting level", shooting={"level": 3}),
}
DEFAULT_METHODS = ("uniform", "adaptive", "disc", "item-id", "level-1", "level-3")


def method_names(text: str) -> tuple[str, ...]:
    """Of ``--methods``: names with commas between them, or all."""
    return names_of(text, METHODS)


def names_of(text: str, known: Mapping[str, object]) -> tuple[str, ...]:
    """Each once, in the order given. Raises ArgumentTypeError for one that is not known."""
    names = tuple(known) if text == "all" else tuple(dict.fromkeys(text.split(",")))
    for name in names:
        if name not in known:
            raise argparse.ArgumentTypeError(f"{name}: must be all, or some of {', '.join(known)}")
    return names
