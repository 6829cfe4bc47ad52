"""Pictures of a session without a window: PNGs for ``shot``, and what benches compare."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from app.errors import UserError
from app.gpu import Gpu
from app.render.false_colour import measured
from app.session.view import View
from app.util.files import replacing
from app.viewer.ui_frame import SAMPLES, pixels, ui_image

__all__ = ["check_size", "picture", "save_png"]


def picture(view: View, size: tuple[int, int]) -> np.ndarray:
    """(height, width, 3) u8 sRGB of the view as it is, top row first. Raises UserError for sizes beyond the GPU's."""
    gpu = view.session.gpu
    check_size(gpu, size)
    if measured(view.shown) != "off" or view.shown.show == "split":
        return ui_image(view, size, panels=False)  # with the legend, or the line between both
    texture = gpu.texture(size, 4, "f1")
    target = gpu.target(texture)
    try:
        view.draw(target, size, samples=SAMPLES)
        return pixels(target, size)
    finally:
        gpu.release_all(target, texture)


def check_size(gpu: Gpu, size: tuple[int, int]) -> None:
    """Raise UserError for a picture that does not fit a texture of this GPU."""
    limit = gpu.limits.max_texture
    if max(size) > limit:
        raise UserError(f"--size {size[0]}x{size[1]}: at most {limit} pixels along a side on this GPU")


def save_png(path: Path, image: np.ndarray, *, level: int = 6) -> None:
    """Write (height, width, 3) u8, top row first; level: of zlib. Raises UserError."""
    try:
        with replacing(path) as partial:
            Image.fromarray(image).save(partial, format="PNG", compress_level=level)
    except OSError as error:
        raise UserError(f"-o {path}: cannot be written: {error.strerror or error}") from None
