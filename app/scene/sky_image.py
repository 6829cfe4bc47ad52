"""Pictures of the whole sky: Radiance .hdr and OpenEXR .exr, equirectangular, in W/(sr m²), linear Rec.709."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import OpenEXR

from app.scene.images import ImageError
from app.scene.model import F32

SUFFIXES = (".hdr", ".exr")
MOST_WIDTH = 2048  # px; larger ones are averaged down, so that their light stays
MOST_PIXELS = 16384 * 8192
FLAT, SCANLINE = 4, (8, 0x7FFF)  # bytes of a pixel; widths of scanlines that may be compressed [Ward94]
EXPOSURE = re.compile(rb"^EXPOSURE\s*=\s*([-+.0-9eE]+)", re.MULTILINE)


def read_sky_image(path: Path) -> F32:
    """(h, w, 3) f32, its first row around the zenith. What is infinite, since half floats end before a sun does, is as bright as
    they can be, or as the brightest pixel; what is negative or no number is 0. ImageError if unusable."""
    try:
        pixels = _exr(path) if path.suffix.lower() == ".exr" else radiance_hdr(path.read_bytes())
    except (OSError, RuntimeError, ValueError, KeyError, IndexError, TypeError, MemoryError) as error:
        raise ImageError(str(error) or "broken") from error
    most = max(float(pixels[np.isfinite(pixels)].max(initial=0)), float(np.finfo(np.float16).max))
    pixels = np.nan_to_num(np.maximum(pixels, np.float32(0)), nan=0.0, posinf=most)
    height, width, _ = pixels.shape
    if abs(width - 2 * height) > 2:
        raise ImageError(f"{width}×{height} pixels: a map of all directions is twice as wide as high")
    step = -(-width // MOST_WIDTH)
    rows, columns = height // step, width // step
    blocks = pixels[: rows * step, : columns * step].reshape(rows, step, columns, step, 3)
    return np.ascontiguousarray(blocks.mean((1, 3)), np.float32)


def _exr(path: Path) -> F32:
    channels = OpenEXR.File(str(path)).channels()
    for name in ("RGB", "RGBA"):
        if name in channels:
            return np.asarray(channels[name].pixels[..., :3], np.float32)
    if not {"R", "G", "B"} <= channels.keys():
        raise ValueError(f"has the channels {', '.join(channels)}, and not R, G, B")
    return np.stack([np.asarray(channels[name].pixels, np.float32) for name in "RGB"], axis=-1)


def radiance_hdr(data: bytes) -> F32:
    """A Radiance picture, RGBE, whose scanlines are flat or compressed run by run, of today or of old, divided by its exposures
    [Ward94]. ValueError if it is none."""
    header, _, rest = data.partition(b"\n\n")
    line, _, body = rest.partition(b"\n")
    size = re.fullmatch(rb"-Y (\d{1,5}) \+X (\d{1,5})", line.strip())
    if not header.startswith((b"#?RADIANCE", b"#?RGBE")) or size is None:
        raise ValueError("not a Radiance picture whose first row is the upper one")
    if b"32-bit_rle_xyze" in header:
        raise ValueError("its colours are XYZ, not RGB")
    height, width = (int(n) for n in size.groups())
    if not 0 < height * width <= MOST_PIXELS:
        raise ValueError(f"{width}×{height} pixels")
    rgbe = np.empty((height, width, FLAT), np.uint8)
    packed = np.frombuffer(body, np.uint8)
    at = 0
    for row in range(height):
        head = packed[at : at + FLAT].tolist()
        try:
            if SCANLINE[0] <= width <= SCANLINE[1] and head[:3] == [2, 2, width >> 8] and head[3] == width & 255:
                at = _scanline(packed, at + FLAT, rgbe[row])
            else:
                at = _old_scanline(packed, at, rgbe[row])
        except IndexError as error:
            raise ValueError(f"it ends within row {row + 1} of {height}") from error
    exponent = rgbe[..., 3:].astype(np.int32) - (128 + 8)
    light = np.ldexp(rgbe[..., :3].astype(np.float32) + np.float32(0.5), exponent)
    exposure = np.prod([float(value) for value in EXPOSURE.findall(header)])
    if not 0 < exposure < np.inf:
        raise ValueError(f"its exposure is {exposure:g}")
    return np.asarray(np.where(rgbe[..., 3:] > 0, light / exposure, 0), np.float32)


def _old_scanline(
    packed: np.ndarray[tuple[int, ...], np.dtype[np.uint8]],
    at: int,
    row: np.ndarray[tuple[int, ...], np.dtype[np.uint8]],
) -> int:
    """Unpack a scanline of whole pixels, where (1, 1, 1, n) repeats the one before n times, and 256 n times where another such
    follows; where the next one begins."""
    width, filled, shift = len(row), 0, 0
    flat = packed[at : at + FLAT * width]
    if len(flat) == FLAT * width and not (flat.reshape(width, FLAT)[:, :3] == 1).all(axis=1).any():
        row[:] = flat.reshape(width, FLAT)
        return at + FLAT * width
    while filled < width:
        r, g, b, n = (int(packed[at + k]) for k in range(FLAT))
        at += FLAT
        if (r, g, b) != (1, 1, 1):
            row[filled] = r, g, b, n
            filled, shift = filled + 1, 0
            continue
        count = n << shift
        if filled == 0 or filled + count > width:
            raise ValueError("a scanline is broken")
        row[filled : filled + count] = row[filled - 1]
        filled, shift = filled + count, shift + 8
    return at


def _scanline(
    packed: np.ndarray[tuple[int, ...], np.dtype[np.uint8]],
    at: int,
    row: np.ndarray[tuple[int, ...], np.dtype[np.uint8]],
) -> int:
    """Unpack the four components of a scanline, one after the other; where the next one begins."""
    width = len(row)
    for component in range(FLAT):
        filled = 0
        while filled < width:
            count = int(packed[at])
            if count > 128:  # a run
                count -= 128
                row[filled : filled + count, component] = packed[at + 1]
                at += 2
            else:
                row[filled : filled + count, component] = packed[at + 1 : at + 1 + count]
                at += 1 + count
            if count == 0 or filled + count > width:
                raise ValueError("a scanline is broken")
            filled += count
    return at


__all__ = ["SUFFIXES", "radiance_hdr", "read_sky_image"]
