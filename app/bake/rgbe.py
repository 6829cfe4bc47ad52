"""Light in four bytes a pixel, three mantissas and one exponent (RGBE, G. Ward, Real pixels, Graphics Gems II, 1991): as .hdr of
Radiance, or in the four channels of a PNG.

The brightest of the three colours is right to 8 bits, 0.4 %.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from app.scene.model import F32

BIAS = 128  # of the exponent


def rgbe(light: F32) -> NDArray[np.uint8]:
    """(h, w, 4) of light (h, w, 3), not negative: value = (mantissa + 1/2) · 2^(exponent - 128 - 8), 0 without exponent."""
    _, exponent = np.frexp(light.max(axis=2))
    exponent = np.clip(exponent, -BIAS + 1, BIAS - 1)
    mantissa = np.clip(np.floor(np.ldexp(light.astype(np.float64), 8 - exponent[..., None])), 0, 255)
    dark = ~(mantissa > 0).any(axis=2)
    shared = np.where(dark, 0, exponent + BIAS)
    return np.concatenate([mantissa, shared[..., None]], axis=2).astype(np.uint8)


def write_hdr(path: Path, light: F32) -> None:
    """As .hdr of Radiance, not run-length encoded. OSError if it cannot be written."""
    height, width = light.shape[:2]
    header = f"#?RADIANCE\nSOFTWARE=glowtree\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
    path.write_bytes(header.encode() + rgbe(light).tobytes())


def write_rgbe_png(path: Path, light: F32) -> None:
    """Write light as a PNG whose alpha is the exponent. OSError if it cannot be written."""
    Image.fromarray(rgbe(light)).save(path, "PNG")
