"""Pictures of a session alone, without the interface: what ``shot`` and the viewer's File menu save, and benches compare."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from app.bake.exr import write_exr
from app.errors import UserError
from app.gpu import Framebuffer, Gpu
from app.render.false_colour import measured
from app.scene.model import F32
from app.session.view import View
from app.util.files import replacing
from app.viewer.ui_frame import SAMPLES, check_size, pixels, ui_image

__all__ = ["SUFFIXES", "check_size", "picture", "save_picture", "save_png"]

SUFFIXES = (".png", ".exr")
RADIANCE = {
    "quantity": "radiance",
    "unit": "W/(sr m2)",
    "comments": "Neither exposed nor tone-mapped; of layers that are no light, what they show.",
}


def save_picture(view: View, path: Path, size: tuple[int, int]) -> None:
    """Write the view as it is, in that size (width, height) [px]: a PNG as the screen shows it, or an EXR of radiance. Raises
    UserError."""
    if path.suffix.lower() not in SUFFIXES:
        raise UserError(f"{path}: a picture is a {' or '.join(SUFFIXES)} file")
    if path.suffix.lower() == ".png":
        save_png(path, picture(view, size))
        return
    pixels = radiance(view, size)
    try:
        with replacing(path) as partial:
            write_exr(partial, pixels, RADIANCE, half=False)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None


def radiance(view: View, size: tuple[int, int]) -> F32:
    """(height, width, 3) f32 [W/(sr m²)], linear Rec.709, top row first. Raises UserError for sizes beyond the GPU's."""
    gpu = view.session.gpu
    check_size(gpu, size)
    with _target(gpu, size, "f4") as target:
        view.draw_radiance(target, size, samples=SAMPLES)
        shown = np.frombuffer(target.read(components=3, dtype="f4"), np.float32).reshape(size[1], size[0], 3)
        return np.ascontiguousarray(shown[::-1])


@contextlib.contextmanager
def _target(gpu: Gpu, size: tuple[int, int], dtype: str) -> Iterator[Framebuffer]:
    """To draw one picture into. Raises GpuError where the driver has no memory for it."""
    texture = gpu.texture(size, 4, dtype)
    try:
        target = gpu.target(texture)
        try:
            yield target
        finally:
            gpu.release_all(target)
    finally:
        gpu.release_all(texture)


def picture(view: View, size: tuple[int, int]) -> np.ndarray:
    """(height, width, 3) u8 sRGB of the view as it is, top row first. Raises UserError for sizes beyond the GPU's."""
    gpu = view.session.gpu
    check_size(gpu, size)
    if measured(view.shown) != "off" or view.shown.show == "split":
        return ui_image(view, size, panels=False)  # with the legend, or the line between both
    with _target(gpu, size, "f1") as target:
        view.draw(target, size, samples=SAMPLES)
        return pixels(target, size)


def save_png(path: Path, image: np.ndarray, *, level: int = 6) -> None:
    """Write (height, width, 3) u8, top row first; level: of zlib. Raises UserError."""
    try:
        with replacing(path) as partial:
            Image.fromarray(image).save(partial, format="PNG", compress_level=level)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None
