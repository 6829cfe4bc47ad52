"""Pictures as linear light: decoding with Pillow, sRGB to linear Rec.709, paths that stay inside the scene's folder.

Only 8-bit sRGB pictures and 16-bit grey ones are met in practice; the sRGB curve is IEC 61966-2-1.
"""

from __future__ import annotations

import io
import urllib.parse
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from app.scene.model import F32
from app.util.words import counted

NAMES_SHOWN = 3  # of pictures that are missing
MAX_SIDE = 2048  # px; diffuse light is blind to finer detail, and a 4096² picture of floats takes 200 MB
MAX_PIXELS = 16384 * 16384  # larger pictures are not decoded at all


class ImageError(ValueError):
    """A picture that is missing, broken or too large; the caller counts it and goes on without."""


def without_pictures(missing: Sequence[str], broken: Sequence[str]) -> str:
    """That these are not there, and those could not be read, for a note."""
    said = []
    for names, what in (
        (missing, f"{'is' if len(missing) == 1 else 'are'} missing in the scene's folder"),
        (broken, "could not be read"),
    ):
        shown = ", ".join(f"'{name}'" for name in names[:NAMES_SHOWN]) + (", ..." if len(names) > NAMES_SHOWN else "")
        said += [f"{counted(len(names), 'picture', 'pictures')} {what} ({shown})"] if names else []
    return ", ".join(said)


def linear_from_srgb(srgb: F32) -> F32:
    """The inverse of the sRGB transfer curve, [0, 1] to [0, 1]."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4).astype(np.float32)


def read_image(source: bytes | Path) -> F32:
    """A picture as (h, w, 3) f32, linear Rec.709, row 0 at the top, at most MAX_SIDE px a side. ImageError if unusable.

    Alpha is ignored. Larger pictures are averaged down in linear light, so that their mean stays.
    """
    return _shrunk(_decoded(_pixels(source, lambda image: image if _is_wide(image) else image.convert("RGB"))))


def read_channel(source: bytes | Path, channel: Literal["R", "A"]) -> F32 | None:
    """Red or alpha of a picture as (h, w, 1) f32, as it stands; None where there is no alpha. Else as ``read_image``."""

    def chosen(image: Image.Image) -> Image.Image | None:
        if channel == "R" and _is_wide(image):
            return image
        return image.convert("RGBA").getchannel(channel) if channel == "R" or image.has_transparency_data else None

    values = _pixels(source, chosen)
    if values.ndim < 2:
        return None
    most = 255.0 if values.dtype == np.uint8 else 65535.0
    return _shrunk(np.clip(values.astype(np.float32) / most, 0.0, 1.0)[:, :, None])


def _is_wide(image: Image.Image) -> bool:
    """Whether it holds more than 8 bits of each number."""
    return image.mode.startswith(("I", "F"))


def _pixels(source: bytes | Path, chosen: Callable[[Image.Image], Image.Image | None]) -> NDArray[Any]:
    """What is chosen of a picture, as an array. ImageError if unusable."""
    try:
        data = io.BytesIO(source) if isinstance(source, bytes) else io.BytesIO(source.read_bytes())
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pillow's remarks on odd metadata; its size limit is checked here
            with Image.open(data) as image:
                if image.width * image.height > MAX_PIXELS:
                    raise ImageError(f"{image.width}×{image.height} pixels are too many")
                return np.asarray(chosen(image))
    except (OSError, UnidentifiedImageError, Image.DecompressionBombError, SyntaxError, EOFError) as error:
        raise ImageError(str(error)) from error
    except (ValueError, TypeError, IndexError, OverflowError, MemoryError) as error:  # what Pillow's decoders leak
        raise ImageError(str(error)) from error


def _decoded(pixels: np.ndarray[tuple[int, ...], np.dtype[np.generic]]) -> F32:
    if pixels.ndim == 2:
        grey = linear_from_srgb(np.clip(pixels.astype(np.float32) / 65535.0, 0.0, 1.0))
        return np.repeat(grey[:, :, None], 3, axis=2)
    table = linear_from_srgb(np.arange(256, dtype=np.float32) / 255.0)
    decoded: F32 = table[pixels]
    return decoded


def _shrunk(pixels: F32) -> F32:
    """Averaged over whole blocks until no side is over MAX_SIDE; an incomplete last block is left out."""
    factor = -(-max(pixels.shape[:2]) // MAX_SIDE)
    if factor <= 1:
        return pixels
    fy, fx = min(factor, pixels.shape[0]), min(factor, pixels.shape[1])
    h, w = pixels.shape[0] // fy, pixels.shape[1] // fx
    blocks = pixels[: h * fy, : w * fx].reshape(h, fy, w, fx, -1)
    mean: F32 = blocks.mean(axis=(1, 3), dtype=np.float32)
    return mean


def path_inside(folder: Path, uri: str) -> Path | None:
    """The file that a relative reference means, or None if there is none inside ``folder``. Percent signs are decoded."""
    return file_inside(folder, folder, urllib.parse.unquote(uri))


def file_inside(root: Path, folder: Path, name: str) -> Path | None:
    """The file that a path from ``folder`` means, in any case, or None if there is none inside ``root``.

    Backslashes are accepted; absolute paths, other schemes and ways out lead nowhere.
    """
    text = name.replace("\\", "/").strip()
    if not text or "\0" in text or ":" in text or text.startswith("/"):
        return None
    try:
        inside, at = root.resolve(), folder.resolve()
        for part in text.split("/"):
            step = (at / part).resolve()
            if not step.exists():
                alike = [entry for entry in sorted(at.iterdir()) if entry.name.casefold() == part.casefold()]
                step = alike[0] if alike else step
            at = step
            if not at.is_relative_to(inside):
                return None
        return at if at.is_file() else None
    except OSError:  # a name too long for the file system, or a file where a folder should be
        return None
