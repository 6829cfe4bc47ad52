"""The files that hold the light of a bake: the lightmap, its direct and its indirect part, in the formats that are asked for."""

from __future__ import annotations

import re

import numpy as np

from app.bake.exr import IRRADIANCE, fits_half, write_exr
from app.bake.options import BakeOptions
from app.bake.rgbe import write_hdr, write_rgbe_png
from app.bake.staged import Staged
from app.scene.model import F32

__all__ = ["IRRADIANCE_NAME", "LIGHT_NAME", "page_names", "write_light"]

STEM = "irradiance"
WHOLE, DIRECT, INDIRECT = "", "direct", "indirect"
EXR, HDR, RGBE_PNG = ".exr", ".hdr", ".rgbe.png"
IRRADIANCE_NAME = f"{STEM}{EXR}"


LIGHT_NAME = re.compile(rf"{STEM}(-{DIRECT}|-{INDIRECT})?(-[0-9]+)?({'|'.join(map(re.escape, (EXR, HDR, RGBE_PNG)))})")


def page_names(pages: int, part: str = WHOLE, ending: str = EXR) -> list[str]:
    """The name of the file of each page."""
    stem = f"{STEM}-{part}" if part else STEM
    return [f"{stem}{ending}"] if pages == 1 else [f"{stem}-{number}{ending}" for number in range(1, pages + 1)]


def write_light(staged: Staged, light: F32, pages: int, options: BakeOptions) -> tuple[str, ...]:
    """Write light (H, W, 3) [W/m²], or (H, W, 6), followed by its direct part, cut into so many pages from the first row on;
    returns what the user should know of it."""
    whole, *direct = np.split(light, light.shape[2] // 3, axis=2)
    fits = fits_half(whole)
    parts = {WHOLE: whole}
    for part in direct:
        parts |= {DIRECT: part, INDIRECT: np.maximum(whole - part, 0)}
    for name, part in parts.items():
        about = IRRADIANCE | {"quantity": f"{name} irradiance".strip()}
        files = [page_names(pages, name, ending) for ending in (EXR, HDR, RGBE_PNG)]
        for page, exr, hdr, rgbe_png in zip(np.split(part, pages), *files, strict=True):
            write_exr(staged(exr), page, about, half=fits and not options.exr_float)
            if options.hdr:
                write_hdr(staged(hdr), page)
            if options.rgbe_png:
                write_rgbe_png(staged(rgbe_png), page)
    if fits or options.exr_float:
        return ()
    return (f"half floats do not hold light of {whole.max():.3g} W/m² well: the lightmap has 32-bit floats",)
