"""Kept hits are what the rays of every texel have hit, traced once: Kahl's visibility cache with a number per ray [Kahl22].

A bank holds so many pages side by side: the k-th page what the k-th ray of each texel hit, another texel. Beyond the memory
that they may take, rays are traced again whenever they are asked for.
"""

from __future__ import annotations

import itertools
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.gpu import Framebuffer, Gpu, Pass, Texture, texture_array
from app.lightmap.lightmap import Lightmap
from app.util.state import State
from app.visibility.origins import Origins
from app.visibility.rays import RayScene

GROUP = 4  # rays whose mean is one sample of the noise, see gather.frag.glsl
PAGES = 4  # along the edge of a bank, where textures may be so large
BYTES = 4  # for each hit


@dataclass
class Bank:
    hits: Texture
    target: Framebuffer


class Hits:
    """Of the texels of one lightmap, the points. Whoever makes it releases it.

    count: rays of each texel that are kept. traced: all rays traced so far, of all texels.
    """

    def __init__(self, gpu: Gpu, points: Lightmap, rays: RayScene, origins: Origins) -> None:
        self._gpu, self._points, self._rays, self._origins = gpu, points, rays, origins
        self._banks: list[Bank] = []
        self.count = self.traced = 0
        self._trace = Pass(gpu, "solvers/gathering/trace", defines=self.defines)
        self._again, self._gather = (
            Pass(gpu, "solvers/gathering/gather", defines={"TRACED": t} | self.defines) for t in (True, False)
        )

        self._count_lost = Pass(gpu, "solvers/gathering/lost")
        self._lost = gpu.texture(points.size, 2, "f4")
        self._lost_target = gpu.target(self._lost)
        self._counted = 0

    @property
    def defines(self) -> dict[str, object]:
        return self._points.defines("MATERIAL_BITS", "TILE") | dict(self._rays.defines)

    @property
    def edge(self) -> int:
        """Pages side by side in a bank."""
        return max(min(PAGES, self._gpu.limits.max_texture // max(self._points.size)), 1)

    @property
    def bank(self) -> int:
        """Rays of each texel in a bank."""
        return self.edge**2

    @property
    def memory(self) -> int:
        """Bytes on the GPU."""
        return len(self._banks) * self._bank_bytes

    @property
    def _bank_bytes(self) -> int:
        width, height = self._points.size
        return width * height * self.bank * BYTES

    def room(self, mebibytes: int) -> int:
        """Rays of each texel for which there is memory: whole banks, one at least, which says what light is lost."""
        return max(mebibytes * 2**20 // self._bank_bytes, 1) * self.bank

    def trace(self, count: int, bands: int) -> Generator[None, None, None]:
        """Trace and keep so many more rays of each texel, in parts: page by page, each in so many bands."""
        (width, height), tiles = self._points.size, self._points.pool.tile
        for _ in range(count):
            bank, page = divmod(self.count, self.bank)
            if bank == len(self._banks):
                self._new_bank()
            x, y, *_ = self._page(page)
            rows = [self._points.rows * nth // bands * tiles for nth in range(bands + 1)]
            for low, high in itertools.pairwise(rows):
                if high > low:
                    self._trace.draw(
                        self._banks[bank].target,
                        textures=self._textures,
                        uniforms={"u_first": bank * self.bank, "u_bank": (width, height, self.edge)} | self._places,
                        scissor=(x, y + low, width, high - low),
                    )
                    yield
            self.count += 1
            self.traced += self._points.texel_count

    def _new_bank(self) -> None:
        width, height = self._points.size
        hits = self._gpu.texture((width * self.edge, height * self.edge), 1, "u4")
        self._banks.append(Bank(hits, self._gpu.target(hits)))

    def _page(self, page: int) -> tuple[int, int, int, int]:
        """Where a page of a bank is: lower corner and size."""
        width, height = self._points.size
        return page % self.edge * width, page // self.edge * height, width, height

    @property
    def _textures(self) -> dict[str, Texture]:
        return self._origins.textures | dict(self._rays.textures) | self._points.textures("t_pages", "t_leaves")

    @property
    def _rows(self) -> dict[str, Any]:
        return {"u_rows": self._points.size[1]}

    @property
    def _places(self) -> dict[str, Any]:
        points = self._points
        return self._rows | {"u_pages": (float(points.columns), points.pool.pages_per_texel)}

    def gather(self, target: Framebuffer, outgoing: Texture, first: int, count: int) -> Iterator[None]:
        """Add what so many rays of each texel find to the target, see gather.frag.glsl, in parts; first, count: multiples of
        GROUP."""
        width, height = self._points.size
        while count > 0:
            if first < self.count:
                bank, within = divmod(first, self.bank)
                some = min(count, self.bank - within, self.count - first)
                self._gather.draw(
                    target,
                    textures={"t_hits": self._banks[bank].hits, "t_outgoing": outgoing},
                    uniforms={"u_rays": (within, some), "u_bank": (width, height, self.edge)} | self._rows,
                    blend="add",
                )
            else:
                some = GROUP
                self._again.draw(
                    target,
                    textures=self._textures | {"t_outgoing": outgoing},
                    uniforms={"u_rays": (first, some)} | self._places,
                    blend="add",
                )
                self.traced += some * self._points.texel_count
            first, count = first + some, count - some
            yield

    def bank_of(self, ray: int) -> tuple[Texture, int, int]:
        """Where a ray of each texel is kept: in which texture, with how many others, and the first of them."""
        nth = ray // self.bank
        return self._banks[nth].hits, min(self.bank, self.count - nth * self.bank), nth * self.bank

    def lost(self) -> tuple[Texture, int]:
        """How many rays of each texel left the scene, and how many ended on black sides, see lost.frag.glsl, of so many."""
        width, height = self._points.size
        if self._counted == 0:
            self._lost_target.clear()
        while self._counted < self.count:
            bank, within = divmod(self._counted, self.bank)
            some = min(self.bank - within, self.count - self._counted)
            self._count_lost.draw(
                self._lost_target,
                textures={"t_hits": self._banks[bank].hits},
                uniforms={"u_rays": (within, some), "u_bank": (width, height, self.edge)} | self._rows,
                blend="add",
            )
            self._counted += some
        return self._lost, self._counted

    def state(self) -> State:
        """What every ray that is kept has hit, page by page."""
        width, height = self._points.size
        pages = np.empty((self.count, height, width), np.uint32)
        for nth, bank in enumerate(self._banks):
            image = texture_array(bank.hits)[..., 0]
            for page, target in enumerate(pages[nth * self.bank : (nth + 1) * self.bank]):
                x, y, *_ = self._page(page)
                target[:] = image[y : y + height, x : x + width]
        return State({"traced": self.traced}, {"pages": pages})

    def restore(self, state: State) -> None:
        """Keep what is in a ``state``, and nothing else. Raises StateError."""
        self.forget()
        pages = state.array("pages", np.uint32, -1, *self._points.size[::-1])
        for first in range(0, len(pages), self.bank):
            self._new_bank()
            for nth, page in enumerate(pages[first : first + self.bank]):
                self._banks[-1].hits.write(page.tobytes(), viewport=self._page(nth))
        self.count, self.traced = len(pages), int(state.values["traced"])

    def forget(self) -> None:
        """No ray has been traced."""
        self._gpu.release_all(*(part for bank in self._banks for part in (bank.target, bank.hits)))
        self._banks.clear()
        self.count = self.traced = self._counted = 0

    def release(self) -> None:
        self.forget()
        self._gpu.release_all(self._lost_target, self._lost)


__all__ = ["GROUP", "Hits"]
