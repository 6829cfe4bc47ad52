"""The log keeps all shots so far, on the GPU: one row for each, as t_shooters has them."""

from __future__ import annotations

import numpy as np

from app.gpu import Framebuffer, Gpu, Pass, Texture, texture_array
from app.scene.model import F32, F64
from app.solvers.shooting.material_edits import MaterialEdits
from app.solvers.shooting.records import BATCH, BLOCK_ROWS
from app.solvers.shooting.shooters import ShooterBatch

PAGE = 2048  # shots in one texture; as many textures as it takes


class ShotLog:
    """Whoever makes it releases it. count: of shots."""

    def __init__(self, gpu: Gpu, shooters: ShooterBatch) -> None:
        self._gpu, self._shooters = gpu, shooters
        self._copy = Pass(gpu, "common/copy")
        self._pages: list[tuple[Texture, Framebuffer]] = []
        self.count = 0

    def add(self, shots: int) -> None:
        """Append the first shots of the batch."""
        for page, row, first, some in _pieces(self.count, shots):
            if page == len(self._pages):
                self._new_page()
            self._draw(self._pages[page][1], self._shooters.texture, first - row, (0, row, BLOCK_ROWS, some))
        self.count += shots

    def _new_page(self) -> None:
        rows = self._gpu.texture((BLOCK_ROWS, PAGE), 4, "f4")
        self._pages.append((rows, self._gpu.target(rows)))

    def rows(self) -> F32:
        """(count, BLOCK_ROWS, 4) f32 of all shots. Waits for the GPU."""
        pages = [texture_array(page) for page, _ in self._pages]
        return np.concatenate([*pages, np.zeros((0, BLOCK_ROWS, 4), np.float32)])[: self.count]

    def restore(self, rows: F32) -> None:
        """Hold these shots, and no others."""
        self.count = len(rows)
        for page, first in enumerate(range(0, self.count, PAGE)):
            if page == len(self._pages):
                self._new_page()
            some = rows[first : first + PAGE]
            self._pages[page][0].write(some.tobytes(), viewport=(0, 0, BLOCK_ROWS, len(some)))

    def recall(self, first: int) -> int:
        """Make the batch of the shots from ``first`` on; how many."""
        shots = min(BATCH, self.count - first)
        for page, row, start, some in _pieces(first, shots):
            self._draw(self._shooters.target, self._pages[page][0], row - start, (0, start, BLOCK_ROWS, some))
        self._shooters.share()
        return shots

    def scale(self, edits: MaterialEdits, factor: F64) -> None:
        """All shots were stronger by a factor (3,) for each channel."""
        for _, target in self._pages:
            edits.scale_shooters(target, factor)

    def clear(self) -> None:
        self.count = 0

    def release(self) -> None:
        self._gpu.release_all(*(resource for page in self._pages for resource in page))
        self._pages.clear()

    def _draw(self, target: Framebuffer, source: Texture, offset: int, viewport: tuple[int, int, int, int]) -> None:
        uniforms = {"u_offset_px": (0, offset)}
        self._copy.draw(target, textures={"t_source": source}, uniforms=uniforms, viewport=viewport)


def _pieces(first: int, shots: int) -> list[tuple[int, int, int, int]]:
    """(page, its row, which of the shots, how many) of shots that may lie on two pages."""
    page, row = divmod(first, PAGE)
    here = min(shots, PAGE - row)
    return [(page, row, 0, here)] + ([(page + 1, 0, here, shots - here)] if shots > here else [])
