"""What can be shown, as a table: a layer is one file in app/shaders/render/layers and one line here."""

from __future__ import annotations

import functools
from dataclasses import dataclass

from app.render.options import LAYERS

SEAMS = "seams"  # see seam_jumps.py


@dataclass(frozen=True)
class Layer:
    """shader: its file. light: the lightmap's texture that it shows as radiance, exposed; None for what is no light and
    is shown as it is. smooth: whether its texels may be interpolated. checker: depth of the texel checker. compares: whether it
    is of a reference, too. measures: in false colour, whatever the display says, what it measures. offered: what a solver must
    know of every texel for it, see app/solvers/base.py, or SEAMS, which is known of any light. defines: those of the lightmap's
    that the shader declares."""

    shader: str
    light: str | None = None
    smooth: bool = True
    checker: float = 0.0
    compares: bool = False
    measures: str = ""
    offered: str = ""
    defines: tuple[str, ...] = ()

    @property
    def received(self) -> bool:
        """Whether it shows light received, which a reference has too."""
        return self.light == "t_irradiance" and not self.compares and not self.offered


LAYER_SHADERS = {
    "combined": Layer("combined", "t_irradiance", defines=("MATERIAL_BITS", "ALBEDO_TEXTURE", "EMISSION_TEXTURE")),
    "irradiance": Layer("irradiance", "t_irradiance"),
    "residual": Layer("offered_light", "t_residual", offered="residual"),
    "albedo": Layer("albedo", defines=("MATERIAL_BITS", "ALBEDO_TEXTURE")),
    "charts": Layer("charts", smooth=False, checker=0.12, defines=("MATERIAL_BITS",)),
    "leaves": Layer("leaves", smooth=False, checker=0.12, defines=("TILE",)),
    "texels": Layer("texels", smooth=False, checker=0.25, defines=("MATERIAL_BITS",)),
    "density": Layer("density", smooth=False, measures="texel density", defines=("MATERIAL_BITS", "TILE")),
    "error": Layer("error", "t_irradiance", compares=True, measures="error"),
    "direct": Layer("offered_light", "t_irradiance", offered="direct"),
    "indirect": Layer("indirect", "t_irradiance", offered="direct"),
    "rays": Layer("count", measures="rays", offered="rays"),
    "expected-error": Layer("deviation", "t_irradiance", measures="expected error", offered="variance"),
    "local": Layer("local_set", smooth=False, offered="local"),
    "seams": Layer("count", measures="jump at seams", offered=SEAMS),
}
assert tuple(LAYER_SHADERS) == LAYERS


@functools.cache
def layers_with(offered: tuple[str, ...]) -> tuple[str, ...]:
    """Those that can be shown where a solver offers so much."""
    return tuple(n for n, layer in LAYER_SHADERS.items() if layer.offered in ("", SEAMS) or layer.offered in offered)
