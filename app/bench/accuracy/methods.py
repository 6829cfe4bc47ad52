"""The methods that ``glowtree bench error`` compares: the default, and one choice at a time besides it."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from app.atlas.options import AtlasOptions
from app.atlas.parametrize import ROOT_SHARE
from app.bench.choices import CURVES_END, chosen_names
from app.lightmap.options import LightmapOptions
from app.options import Options, from_flags
from app.solvers import DEFAULT_SOLVER, SOLVERS, Family

RAY_TEXELS = 65_536  # few texels with many rays have less error, for the same time, than many with few


@dataclass(frozen=True)
class Setup:
    """How a scene is cut, how its light is held, and which solver finds it."""

    atlas: AtlasOptions
    light: LightmapOptions
    solver: str
    options: Options

    @property
    def family(self) -> Family:
        return SOLVERS[self.solver]

    def as_dict(self) -> dict[str, Any]:
        """For reports: options of the solver under its name."""
        return {
            "atlas": self.atlas.as_dict(),
            "lightmap": self.light.as_dict(),
            self.solver: self.options.as_dict(),
        }


@dataclass(frozen=True)
class Method:
    """axis: what is chosen. solver: of SOLVERS. options, light: those of the solver and of the lightmap that differ from what was
    asked for. texels: uniform ones, where none were asked for; None for as many as suit the scene."""

    axis: str
    solver: str = DEFAULT_SOLVER
    options: Mapping[str, Any] = field(default_factory=dict)
    light: dict[str, Any] = field(default_factory=dict)
    texels: int | None = None

    @property
    def adaptive(self) -> bool:
        return bool(self.light.get("adaptive", False))

    def setup(self, texels: int | None, flags: argparse.Namespace) -> Setup:
        """texels: uniform ones; quadtrees begin with a sixteenth, so that some of their leaves become as fine or finer. flags:
        all other options that were asked for. Raises UserError."""
        texels = texels or self.texels
        if self.adaptive and texels is not None:
            texels = max(texels // ROOT_SHARE, 1)
        light = from_flags(LightmapOptions, flags).replace(**({"adaptive": False} | self.light))
        options = from_flags(SOLVERS[self.solver].options, flags, CURVES_END).replace(**self.options)
        return Setup(AtlasOptions(texels=texels), light, self.solver, options)


METHODS = {
    "uniform": Method("lightmap"),
    "adaptive": Method("lightmap", light={"adaptive": True}),
    "gathering": Method("solver", solver="gathering", texels=RAY_TEXELS),
    "gathering-adaptive": Method("solver", solver="gathering", light={"adaptive": True}),
    "local": Method("solver", solver="local", texels=RAY_TEXELS),
    "pairs": Method("solver", solver="pairs"),
    "disc": Method("form factor", options={"form_factor": "disc"}),
    "item-id": Method("visibility", options={"visibility": "item-id"}),
    "depth": Method("visibility", options={"visibility": "depth"}),
    "stereographic": Method("projection", options={"projection": "stereographic"}),
    "nonlinear": Method("projection", options={"projection": "nonlinear"}),
    "rgba16f": Method("storage", light={"storage": "rgba16f"}),
    "fixed8": Method("storage", light={"storage": "fixed8"}),
    "level-1": Method("shooting level", options={"level": 1}),
    "level-3": Method("shooting level", options={"level": 3}),
}


def method_names(text: str) -> tuple[str, ...]:
    """Of ``--methods``: names with commas between them, or all."""
    return chosen_names(text, METHODS)
