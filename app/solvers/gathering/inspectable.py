"""What gathering shows of itself: what it knows of every texel, and the rays of one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from app.direct_light.shadow_rays import DirectLight
from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64
from app.solvers.base import Inspection, Progress, Rays
from app.solvers.gathering.compose import Compose
from app.solvers.gathering.hits import Hits
from app.visibility.origins import Origins

MOST_RAYS = 4096  # of a texel that are looked at: the first ones are spread as evenly as all
SEEN = (
    "What the kept rays of the picked texel bring, seen from it along its normal and flattened so that equal areas bring equal "
    "light: a cell for each ray, exposed like the picture. What comes straight from lamps is not in it: shadow rays look at them"
)


class Inspectable:
    """Of one lightmap, whose rays are those of its points. Whoever makes it releases it."""

    def __init__(
        self,
        gpu: Gpu,
        lightmap: Lightmap,
        points: Lightmap,
        origins: Origins,
        hits: Hits,
        directs: Sequence[DirectLight],
        compose: Compose,
    ) -> None:
        """origins: of the points; directs: the last on the texels of the lightmap."""
        self._gpu, self._lightmap, self._points, self._origins, self._hits = gpu, lightmap, points, origins, hits
        self._directs, self._direct, self._compose = directs, directs[-1], compose
        self._look = Pass(gpu, "solvers/gathering/kept_rays", defines=lightmap.defines("MATERIAL_BITS", "TILE"))
        self._rays: tuple[Texture, Framebuffer] | None = None

    def layers(self, rays: int) -> Mapping[str, Texture]:
        """See app/solvers/base.py. rays: of each texel."""
        return {"direct": self._shown, "variance": self._compose.variance, "rays": self._ray_counts(rays)}

    def _ray_counts(self, rays: int) -> Texture:
        """Rays of each texel, the same for all."""
        if self._rays is None or self._rays[0].size != self._lightmap.size:
            self.release()
            counts = self._gpu.texture(self._lightmap.size, 1, "f4")
            self._rays = counts, self._gpu.target(counts)
        counts, target = self._rays
        target.clear(float(rays))
        return counts

    def inspect(
        self, texel: tuple[int, int] | None, progress: Progress, bounces: int, outgoing: Texture | None
    ) -> Inspection:
        """How much is traced and kept, and in how many bounces light was found last; of a texel (column, row), its direct and
        indirect light, and with ``outgoing``, see bounces.py, its rays. Waits for the GPU where a texel is given."""
        hits = self._hits
        figures = {
            "Rays per texel": f"{progress.done:,}, {'all' if hits.count >= progress.done else f'{hits.count:,}'} kept",
            "Kept hits": f"{hits.memory / 2**20:.1f} MiB",
            "Bounces": f"{bounces}",
        }
        traced = hits.traced + sum(direct.traced for direct in self._directs)
        whole = Inspection(figures=figures, counts={"Rays traced": traced})
        if texel is None or any(at >= size for at, size in zip(texel, self._lightmap.size, strict=True)):
            return whole
        return replace(
            whole,
            texel_facts={"Kept rays": f"{self._hits.count:,}"},
            texel_light=self._parts(texel),
            rays=None if outgoing is None else self.rays(texel, outgoing),
        )

    @property
    def _shown(self) -> Texture:
        """Direct light as it is shown."""
        return self._compose.direct or self._direct.light

    def _parts(self, texel: tuple[int, int]) -> dict[str, F64]:
        """Direct and indirect H [W/m²]."""
        target = self._gpu.target(self._shown)
        stored = np.frombuffer(target.read((*texel, 1, 1), 3, dtype="f4", alignment=1), np.float32)
        self._gpu.release_all(target)
        direct = stored.astype(np.float64) * self._lightmap.unit
        return {"direct": direct, "indirect": self._lightmap.light_at(texel)[0] - direct}

    def rays(self, texel: tuple[int, int], outgoing: Texture) -> Rays | None:
        """The kept rays of the point of a texel, and what they find of ``outgoing``; None where there are none. Waits for the
        GPU."""
        hits, points = self._hits, self._points
        texel = self._point_of(texel)
        count = min(hits.count, MOST_RAYS)
        if count == 0:
            return None
        textures = [self._gpu.texture((count, 1), 4, "f4") for _ in range(3)]
        target = self._gpu.target(*textures)
        first = 0
        while first < count:
            kept, rays, first = hits.bank_of(first)
            self._look.draw(
                target,
                textures=self._origins.textures
                | points.textures("t_position_area")
                | {"t_hits": kept, "t_outgoing": outgoing},
                uniforms={
                    "u_texel": texel,
                    "u_first": first,
                    "u_rows": points.size[1],
                    "u_bank": (*points.size, hits.edge),
                },
                viewport=(first, 0, min(rays, count - first), 1),
            )
            first += rays
        start, end, light = (
            np.frombuffer(texture.read(), np.float32).reshape(-1, 4)[:, :3].copy() for texture in textures
        )
        self._gpu.release_all(target, *textures)
        return Rays(start, end, light * np.float32(self._lightmap.unit))

    def _point_of(self, texel: tuple[int, int]) -> tuple[int, int]:
        """The point in which the middle of a texel (column, row) of the lightmap lies."""
        if self._points is self._lightmap:
            return texel
        pool = self._points.pool
        left, bottom, right, top = self._lightmap.pool.atlas_rect(texel, 1)
        u, v = (left + right) / 2, (bottom + top) / 2
        slot = pool.slot_at((u, v))
        (column, row), finer = pool.corner(slot), 2 ** int(pool.leaves.level[slot])
        return column + int(u * finer) % pool.tile, row + int(v * finer) % pool.tile

    def release(self) -> None:
        if self._rays is not None:
            self._gpu.release_all(*self._rays)
            self._rays = None
