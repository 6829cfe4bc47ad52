"""Pictures of a session alone, without the interface: what ``shot`` and the viewer's File menu save, and benches compare."""

from __future__ import annotations

import contextlib
from collections.abc import Generator, Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from app.bake.exr import write_exr
from app.errors import UserError
from app.gpu import Framebuffer, Gpu
from app.render.false_colour import measured
from app.session.view import View
from app.util.files import replacing
from app.util.parts import run_to_end
from app.viewer.ui_frame import SAMPLES, check_size, parts_of_ui_image, pixels

__all__ = [
    "SUFFIXES",
    "check_size",
    "check_suffix",
    "is_linear",
    "parts_of_picture",
    "picture",
    "save_picture",
    "save_png",
    "write_picture",
]

SUFFIXES = (".png", ".exr")
RADIANCE = {
    "quantity": "radiance",
    "unit": "W/(sr m2)",
    "comments": "Neither exposed nor tone-mapped; of layers that are no light, what they show.",
}


def save_picture(view: View, path: Path, size: tuple[int, int]) -> None:
    """Write the view as it is, in that size (width, height) [px]: a PNG as the screen shows it, or an EXR of radiance. Raises
    UserError."""
    check_suffix(path)
    if not is_linear(path):
        write_picture(path, picture(view, size))
        return
    twin = view.twin(linear=True)
    try:
        write_picture(path, picture(twin, size))
    finally:
        twin.release()


def check_suffix(path: Path) -> None:
    """Raise UserError for what is no file of a picture."""
    if path.suffix.lower() not in SUFFIXES:
        raise UserError(f"{path}: a picture is a {' or '.join(SUFFIXES)} file")


def is_linear(path: Path) -> bool:
    """Whether the file is one of radiance."""
    return path.suffix.lower() == ".exr"


def write_picture(path: Path, image: np.ndarray) -> None:
    """Write what ``parts_of_picture`` has drawn for that file; needs no GPU. Raises UserError."""
    if not is_linear(path):
        save_png(path, image)
        return
    try:
        with replacing(path) as partial:
            write_exr(partial, image, RADIANCE, half=False)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None


def picture(view: View, size: tuple[int, int]) -> np.ndarray:
    """The whole, as ``parts_of_picture``, with all of the light."""
    view.wait_for_light()
    return run_to_end(parts_of_picture(view, size))


def parts_of_picture(view: View, size: tuple[int, int]) -> Generator[float, None, np.ndarray]:
    """Draw a picture of the view in parts, one of its samples after the other; yields the share that is drawn. Then it is
    (height, width, 3), top row first: u8 sRGB, or of a linear view f32 radiance [W/(sr m²)], linear Rec.709. The light is that of
    the first part, and the scene must stay open. Raises UserError for sizes beyond the GPU's."""
    gpu = view.session.gpu
    check_size(gpu, size)
    if not view.linear and (measured(view.shown) != "off" or view.shown.show == "split"):
        return (yield from parts_of_ui_image(view, size, panels=False))  # with the legend, or the line between both
    view.forget_samples()
    with _target(gpu, size, "f4" if view.linear else "f1") as target:
        for drawn in range(SAMPLES):
            view.draw(target, size, add=True)
            gpu.ctx.finish()
            yield (drawn + 1) / SAMPLES
        if not view.linear:
            return pixels(target, size)
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


def save_png(path: Path, image: np.ndarray, *, level: int = 6) -> None:
    """Write (height, width, 3) u8, top row first; level: of zlib. Raises UserError."""
    try:
        with replacing(path) as partial:
            Image.fromarray(image).save(partial, format="PNG", compress_level=level)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None
