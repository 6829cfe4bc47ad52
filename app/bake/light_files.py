"""The files that hold the light of a bake: the lightmap, its direct and its indirect part, in the formats that are asked for."""

from __future__ import annotations

import numpy as np

from app.bake.exr import IRRADIANCE, fits_half, write_exr
from app.bake.options import BakeOptions
from app.bake.rgbe import write_hdr, write_rgbe_png
from app.bake.staged import Staged
from app.scene.model import F32

__all__ = ["IRRADIANCE_NAME", "LIGHT_NAMES", "write_light"]

STEM = "irradiance"
WHOLE, DIRECT, INDIRECT = "", "direct", "indirect"
EXR, HDR, RGBE_PNG = ".exr", ".hdr", ".rgbe.png"
IRRADIANCE_NAME = f"{STEM}{EXR}"


def _name(part: str, ending: str) -> str:
    return f"{STEM}-{part}{ending}" if part else f"{STEM}{ending}"


LIGHT_NAMES = {_name(part, ending) for part in (WHOLE, DIRECT, INDIRECT) for ending in (EXR, HDR, RGBE_PNG)}


def write_light(staged: Staged, light: F32, options: BakeOptions) -> tuple[str, ...]:
    """Write light (H, W, 3) [W/m²], or (H, W, 6), followed by its direct part; returns what the user should know of it."""
    whole, *direct = np.split(light, light.shape[2] // 3, axis=2)
    fits = fits_half(whole)
    parts = {WHOLE: whole}
    for part in direct:
        parts |= {DIRECT: part, INDIRECT: np.maximum(whole - part, 0)}
    for name, part in parts.items():
        about = IRRADIANCE | {"quantity": f"{name} irradiance".strip()}
        write_exr(staged(_name(name, EXR)), part, about, half=fits and not options.exr_float)
        if options.hdr:
            write_hdr(staged(_name(name, HDR)), part)
        if options.rgbe_png:
            write_rgbe_png(staged(_name(name, RGBE_PNG)), part)
    if fits or options.exr_float:
        return ()
    return (f"half floats do not hold light of {whole.max():.3g} W/m² well: {IRRADIANCE_NAME} has 32-bit floats",)
