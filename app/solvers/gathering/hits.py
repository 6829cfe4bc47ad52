"""Kept hits are what the rays of every texel have hit, traced once: Kahl's visibility cache with a number per ray [Kahl22].

A bank holds so many pages side by side: the k-th page what the k-th ray of each texel hit, a texel of level 0 of the atlas, so
that hits outlive the growth of quadtrees. Beyond the memory that they may take, rays are traced again whenever asked for.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.gpu import Framebuffer, Gpu, Mesh, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import QUAD_FORMAT, quads
from app.lightmap.tile_pool import Moves
from app.scene.model import F32
from app.solvers.gathering.origins import Origins
from app.visibility.rays import RayScene

GROUP = 8  # rays whose mean is one sample of the noise, see gather.frag.glsl
PAGES = 4  # along the edge of a bank, where textures may be so large
BYTES = 4  # for each hit


@dataclass
class Bank:
    hits: Texture
    target: Framebuffer


class Hits:
    """Of one lightmap. Whoever makes it releases it.

    count: rays of each texel that are kept. traced: all rays traced so far, of all texels.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, rays: RayScene, origins: Origins) -> None:
        self._gpu, self._lightmap, self._rays, self._origins = gpu, lightmap, rays, origins
        self._banks: list[Bank] = []
        self.count = self.traced = 0
        self._trace = Pass(gpu, "solvers/gathering/trace", defines=self.defines, vertex="common/rects")
        self._again, self._gather = (
            Pass(gpu, "solvers/gathering/gather", defines={"TRACED": t} | self.defines) for t in (True, False)
        )

        self._count_lost = Pass(gpu, "solvers/gathering/lost")
        self._lost = gpu.texture(lightmap.size, 2, "f4")
        self._lost_target = gpu.target(self._lost)
        self._counted = 0

    @property
    def defines(self) -> dict[str, object]:
        return self._lightmap.defines("MATERIAL_BITS", "TILE") | dict(self._rays.defines)

    @property
    def edge(self) -> int:
        """Pages side by side in a bank."""
        return max(min(PAGES, self._gpu.limits.max_texture // max(self._lightmap.size)), 1)

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
        width, height = self._lightmap.size
        return width * height * self.bank * BYTES

    def room(self, mebibytes: int) -> int:
        """Rays of each texel for which there is memory: whole banks."""
        return mebibytes * 2**20 // self._bank_bytes * self.bank

    def trace(self, count: int, bands: int) -> Iterator[None]:
        """Trace and keep so many more rays of each texel, in parts: page by page, each in so many bands."""
        (width, height), tiles = self._lightmap.size, self._lightmap.pool.tile
        for _ in range(count):
            bank, page = divmod(self.count, self.bank)
            if bank == len(self._banks):
                size = width * self.edge, height * self.edge
                hits = self._gpu.texture(size, 1, "u4")
                self._banks.append(Bank(hits, self._gpu.target(hits)))
            x, y = page % self.edge * width, page // self.edge * height
            rows = [self._lightmap.rows * nth // bands * tiles for nth in range(bands + 1)]
            for low, high in itertools.pairwise(rows):
                if high > low:
                    self._draw(bank, np.array([(x, y + low, width, high - low, 0, low)], np.float32))
                    yield
            self.count += 1
            self.traced += self._lightmap.texel_count

    def trace_tiles(self, slots: NDArray[np.int64]) -> Iterator[None]:
        """Trace the rays that other leaves keep for those in these slots too, in parts."""
        pool, size = self._lightmap.pool, np.array(self._lightmap.size)
        for bank in range(len(self._banks)):
            for page in range(min(self.bank, self.count - bank * self.bank)):
                offset = (size * (page % self.edge, page // self.edge)).astype(np.int64)
                self._draw(bank, quads(pool.corners(slots) + offset, pool.tile, pool.corners(slots)))
                if page % GROUP == GROUP - 1:
                    yield
        self.traced += self.count * int((pool.surfaces.face[slots] >= 0).sum())
        self._counted = 0

    def _draw(self, bank: int, rects: F32) -> None:
        """Trace in these rectangles of a bank, see common/rects.vert.glsl."""
        target = self._banks[bank].target
        mesh = Mesh(self._gpu, rects.tobytes(), QUAD_FORMAT, per_instance=True)
        self._trace.draw(
            target,
            textures=self._textures,
            uniforms={"u_first": bank * self.bank, "u_pages": (*self._lightmap.size, self.edge), "u_size": target.size}
            | self._rows,
            mesh=mesh,
        )
        self._gpu.release_all(mesh)

    def resized(self, before: tuple[int, int], moves: Moves) -> None:
        """The tile pool, which had this size [texels], has got another number of slots."""
        edge, old = self.edge, list(self._banks)
        lightmap, self._banks = self._lightmap, []
        for bank in old:
            hits = self._gpu.texture((lightmap.size[0] * edge, lightmap.size[1] * edge), 1, "u4")
            target = self._gpu.target(hits)
            self._banks.append(Bank(hits, target))
            for page in range(edge**2):
                at = np.array((page % edge, page // edge))
                rects = lightmap.move_rects(moves) + np.concatenate([at * lightmap.size, (0, 0), at * before])
                lightmap.move(bank.hits, target, rects.astype(np.float32))
            self._gpu.release_all(bank.target, bank.hits)
        self._gpu.release_all(self._lost_target, self._lost)
        self._lost = self._gpu.texture(lightmap.size, 2, "f4")
        self._lost_target = self._gpu.target(self._lost)
        self._counted = 0

    @property
    def _textures(self) -> dict[str, Texture]:
        return self._origins.textures | dict(self._rays.textures)

    @property
    def _rows(self) -> dict[str, Any]:
        return {"u_rows": self._lightmap.charts.size[1]}

    def gather(self, target: Framebuffer, outgoing: Texture, first: int, count: int) -> Iterator[None]:
        """Add what so many rays of each texel find to the target, see gather.frag.glsl, in parts; first, count: multiples of
        GROUP."""
        width, height = self._lightmap.size
        while count > 0:
            if first < self.count:
                bank, within = divmod(first, self.bank)
                some = min(count, self.bank - within, self.count - first)
                self._gather.draw(
                    target,
                    textures={"t_hits": self._banks[bank].hits, "t_outgoing": outgoing},
                    uniforms={"u_rays": (within, some), "u_pages": (width, height, self.edge)},
                    blend="add",
                )
            else:
                some = GROUP
                self._again.draw(
                    target,
                    textures=self._textures | {"t_outgoing": outgoing},
                    uniforms={"u_rays": (first, some)} | self._rows,
                    blend="add",
                )
                self.traced += some * self._lightmap.texel_count
            first, count = first + some, count - some
            yield

    def bank_of(self, ray: int) -> tuple[Texture, int, int]:
        """Where a ray of each texel is kept: in which texture, with how many others, and the first of them."""
        nth = ray // self.bank
        return self._banks[nth].hits, min(self.bank, self.count - nth * self.bank), nth * self.bank

    def lost(self) -> tuple[Texture, int]:
        """How many rays of each texel left the scene, and how many ended on black sides, see lost.frag.glsl, of so many."""
        width, height = self._lightmap.size
        if self._counted == 0:
            self._lost_target.clear()
        while self._counted < self.count:
            bank, within = divmod(self._counted, self.bank)
            some = min(self.bank - within, self.count - self._counted)
            self._count_lost.draw(
                self._lost_target,
                textures={"t_hits": self._banks[bank].hits},
                uniforms={"u_rays": (within, some), "u_pages": (width, height, self.edge)} | self._rows,
                blend="add",
            )
            self._counted += some
        return self._lost, self._counted

    def forget(self) -> None:
        """No ray has been traced."""
        self._gpu.release_all(*(part for bank in self._banks for part in (bank.target, bank.hits)))
        self._banks.clear()
        self.count = self.traced = self._counted = 0

    def release(self) -> None:
        self.forget()
        self._gpu.release_all(self._lost_target, self._lost)


__all__ = ["GROUP", "Hits"]
