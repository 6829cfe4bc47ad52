"""Light as OpenEXR: half or single floats, linear Rec.709, channels R, G, B, ZIP.

Half floats have 11 bits of precision from 6.1e-5 to 65504, which is what renderers of the web and of games hold lightmaps in.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import OpenEXR

from app import __version__
from app.scene.model import F32

# CIE xy of red, green, blue and white (D65): ITU-R BT.709-6, 1.3 and 1.4
REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)


IRRADIANCE = {
    "quantity": "irradiance",
    "unit": "W/m2",
    "comments": "Irradiance H; diffuse surfaces reflect albedo * H / pi [W/(sr m2)]. First scanline: v = 0 (glTF).",
}
HALF_MOST = 65504.0  # the largest half float
HALF_DIM = 2.0**-4  # what is brightest should be above: then a thousandth of it has all 11 bits


def fits_half(light: F32) -> bool:
    """Whether half floats hold this light with the precision that they have."""
    return HALF_DIM <= float(light.max(initial=HALF_DIM)) <= HALF_MOST


def write_exr(path: Path, light: F32, about: Mapping[str, str], *, half: bool) -> None:
    """Write light (height, width, 3) f32; of a lightmap, the first scanline is row 0, v = 0 in glTF. OSError if it cannot be.

    about: the quantity, its unit and comments, for the header, so that no reader has to guess.
    """
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "chromaticities": REC709,
        "software": f"glowtree {__version__}",
        "primaries": "Rec.709, linear",
        **about,
    }
    pixels = np.ascontiguousarray(light, np.float16 if half else np.float32)
    try:
        OpenEXR.File(header, {"RGB": pixels}).write(str(path))
    except RuntimeError as error:  # what the library raises for any failure to open or write
        raise OSError(str(error)) from error
