"""The sky of a scene as OpenEXR, for what is seen through its windows."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from app.bake.exr import HALF_MOST, write_exr
from app.scene.sky import Sky

SKY = {
    "quantity": "radiance",
    "unit": "W/(m2 sr)",
    "comments": "Equirectangular, without the sun's disc. First scanline: zenith; its middle: +x, a quarter to the left: -z.",
}
LEAST = 64, 32  # px: a uniform sky is held in one


def write_sky(path: Path, sky: Sky) -> None:
    """Write its map, turned so that renderers of glTF see each direction where it was. OSError if it cannot be written."""
    light = np.asarray(sky.radiance, np.float32)
    rows, columns = (-(-least // n) for least, n in zip(LEAST[::-1], light.shape, strict=False))
    light = np.repeat(np.repeat(light, rows, axis=0), columns, axis=1)
    light = np.roll(light, round(light.shape[1] / 4), axis=1)  # ours begins at -z
    write_exr(path, np.minimum(light, HALF_MOST), SKY, half=True)
