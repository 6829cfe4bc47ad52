"""The pictures of a walk as files: numbered PNGs in a folder, or one animated picture.

Pictures go to a folder as they come, to a hidden one beside the animated picture that is made of them in the end: a walk of many
pictures does not have to fit into memory.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from app.errors import UserError
from app.util.files import replacing
from app.viewer.picture import save_png

__all__ = ["FrameFolder", "animated", "check_animation", "frame_folder", "save_animation"]

SUFFIXES = (".webp", ".gif", ".png")
OPTIONS: dict[str, dict[str, Any]] = {".webp": {"quality": 80}, ".gif": {}, ".png": {}}
LONGEST_SIDE = {".webp": 16383, ".gif": 65535, ".png": 2**31 - 1}  # px, by the formats
HELD = {".webp": 0, ".gif": 1, ".png": 4}  # bytes of each pixel that Pillow keeps of all pictures until it writes
MOST_HELD = 4 * 2**30  # bytes
GIF_TICK = 10.0  # ms: what a GIF counts in; viewers slow down below two of them


class FrameFolder:
    """A folder that pictures are added to, as 0001.png and on; it is made when the first one comes."""

    def __init__(self, path: Path, *, fast: bool = False) -> None:
        """fast: larger files, written sooner."""
        self.path, self.count = path, 0
        self._level = 1 if fast else 6

    def add(self, image: np.ndarray) -> None:
        """(height, width, 3) u8, top row first. Raises UserError."""
        try:
            self.path.mkdir(exist_ok=True)
        except OSError as error:
            raise UserError(f"-o {self.path}: cannot be written: {error.strerror or error}") from None
        save_png(self.file(self.count), image, level=self._level)
        self.count += 1

    def file(self, k: int) -> Path:
        """Of the k-th picture, from 0 on."""
        return self.path / f"{k + 1:04d}.png"

    @property
    def left_over(self) -> Path | None:
        """The next picture, where an earlier and longer walk has left one."""
        return self.file(self.count) if self.file(self.count).exists() else None


def animated(output: Path) -> bool:
    """Whether ``-o`` means one animated picture, rather than a folder."""
    return bool(output.suffix) and not output.is_dir()


def check_animation(output: Path, frames: int, frames_per_second: float, size: tuple[int, int]) -> None:
    """Raise UserError for what cannot become one animated picture, and for what is neither its name nor that of a folder."""
    if not animated(output):
        if output.exists() and not output.is_dir():
            raise UserError(f"-o {output}: is no folder")
        return
    kind = output.suffix.lower()
    if kind not in SUFFIXES:
        raise UserError(
            f"-o {output}: must be a {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]} file, or a folder, for a walk"
        )
    shown = f"{size[0]}x{size[1]}"
    if max(size) > LONGEST_SIDE[kind]:
        raise UserError(f"-o {output}: {shown}: at most {LONGEST_SIDE[kind]} pixels along a side in a {kind} file")
    if frames * size[0] * size[1] * HELD[kind] > MOST_HELD:
        raise UserError(
            f"-o {output}: {frames} frames of {shown} are too many for one {kind} file: take .webp, or a folder"
        )
    if kind == ".gif" and 1000 / frames_per_second < 2 * GIF_TICK:
        raise UserError(
            f"-o {output}: {frames_per_second:g} frames a second: a .gif file has at most {500 / GIF_TICK:g}"
        )


@contextlib.contextmanager
def frame_folder(output: Path) -> Iterator[FrameFolder]:
    """Where the pictures of a walk go: the folder ``output``, or one that is gone afterwards. Raises UserError."""
    if not animated(output):
        yield FrameFolder(output)
        return
    try:
        made = tempfile.TemporaryDirectory(prefix=f".{output.name}.", dir=output.parent)
    except OSError as error:
        raise UserError(f"-o {output}: cannot be written: {error.strerror or error}") from None
    with made as folder:
        yield FrameFolder(Path(folder), fast=True)


def save_animation(output: Path, frames: FrameFolder, frames_per_second: float, tell: Callable[[int], None]) -> None:
    """Make one picture of all that were added, over and over again from the first. tell: is given how many were read. Raises
    UserError."""
    kind = output.suffix.lower()
    durations = _durations(frames.count, 1000 / frames_per_second, GIF_TICK if kind == ".gif" else None)
    more = {**OPTIONS[kind], "save_all": True, "loop": 0, "duration": durations}
    try:
        with replacing(output) as partial:
            _Film(frames, tell).save(partial, format={".webp": "WEBP", ".gif": "GIF", ".png": "PNG"}[kind], **more)
    except (OSError, ValueError) as error:
        raise UserError(f"-o {output}: cannot be written: {getattr(error, 'strerror', None) or error}") from None


def _durations(count: int, each: float, tick: float | None) -> list[float]:
    """(count,) [ms]; in whole ticks, where there are any, that do not drift away."""
    if tick is None:
        return [each] * count
    ends = np.round(np.arange(count + 1) * each / tick) * tick
    return [float(x) for x in np.diff(ends)]


class _Film(Image.Image):
    """All pictures of a folder as one of many frames, which Pillow reads one after the other."""

    def __init__(self, frames: FrameFolder, tell: Callable[[int], None]) -> None:
        super().__init__()
        self._frames, self._tell, self._at, self._read = frames, tell, 0, 0
        self.n_frames, self.is_animated = frames.count, frames.count > 1
        self.seek(0)

    def seek(self, frame: int) -> None:
        if not 0 <= frame < self.n_frames:
            raise EOFError(f"frame {frame} of {self.n_frames}")
        with Image.open(self._frames.file(frame)) as image:
            image.load()
            self.im, self._mode, self._size, self._at = image.im, image.mode, image.size, frame
        self._read = max(self._read, frame + 1)  # Pillow goes back to the first in the end
        self._tell(self._read)

    def tell(self) -> int:
        return self._at
