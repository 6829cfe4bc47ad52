"""The irradiance lightmap as OpenEXR: 32-bit floats, linear Rec.709, channels R, G, B, ZIP."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR

from app import __version__
from app.scene.model import F32

# CIE xy of red, green, blue and white (D65): ITU-R BT.709-6, 1.3 and 1.4
REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)


def write_irradiance(path: Path, irradiance: F32) -> None:
    """Write irradiance (height, width, 3) f32 [W/m²]; the first scanline is row 0, v = 0 in glTF. OSError if it cannot be.

    The header names the quantity, its unit and the primaries, so that no reader has to guess.
    """
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "chromaticities": REC709,
        "software": f"glowtree {__version__}",
        "quantity": "irradiance",
        "unit": "W/m2",
        "primaries": "Rec.709, linear",
        "comments": "Irradiance H; diffuse surfaces reflect albedo * H / pi [W/(sr m2)]. First scanline: v = 0 (glTF).",
    }
    pixels = np.ascontiguousarray(irradiance, np.float32)
    try:
        OpenEXR.File(header, {"RGB": pixels}).write(str(path))
    except RuntimeError as error:  # what the library raises for any failure to open or write
        raise OSError(str(error)) from error
