"""Seeing draws what the shooters of a batch see: item and depth in every direction of a hemisphere [Coombe03, 3.2; Cohen85].

The maps of several shooters lie above each other in one texture, all drawn at once.
"""

from __future__ import annotations

import numpy as np

from app.gpu import Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.solvers.shooting.options import ShootingOptions
from app.solvers.shooting.records import BATCH, IN_BLOCKS, OPEN, RECORDS, Shot
from app.solvers.shooting.shooters import Blocks, ShooterBatch
from app.visibility.projections import PROJECTIONS, Occluders

# px, of maps that follow from the scene. Below, shadows of few texels get coarse too: 128 for 256 makes 2.2 % error 2.6 % in the
# Cornell box of 32,000 texels. Above, there is little to gain: 512 for 256 takes 181,000 texels of an other scene half as long
# again, for 1 % less error.
RESOLUTIONS = (256, 512)
ESCAPED_BLOCK = 8  # visibility texels along the edge of a block that escaped.frag.glsl sums
MAPS_TEXELS = 2**21  # of visibility that are drawn at once: more gain little and cost memory


def fitting_resolution(lightmap: Lightmap, texel_level: int) -> int:
    """Edge of a map's full face [px] in which a texel half the scene's diagonal away fills one sample: a face of N samples is 2
    wide at distance 1, so N = 2 / texel in the solver space. texel_level: of the texels that matter, finer than the roots."""
    texel = 1.0 / (lightmap.charts.density * lightmap.space.scale) / (1 << texel_level)
    return int(np.clip(64 * round(2.0 / texel / 64), *RESOLUTIONS))


class Maps:
    """Visibility maps of some shots, and how much of what these send out escapes. Whoever makes it releases it.

    count: of maps that lie above each other; map_size: of one [px].
    """

    def __init__(self, gpu: Gpu, map_size: tuple[int, int], count: int) -> None:
        self._gpu, self.count = gpu, count
        width, height = self.map_size = map_size
        # two textures of four bytes: llvmpipe clears eight bytes ten times slower
        self.items = gpu.texture((width, height * count), 1, "f4")
        self.depth = gpu.depth_texture(self.items.size)
        self.escaped_size = (width // ESCAPED_BLOCK, height // ESCAPED_BLOCK)  # blocks of one shot
        self.escaped = gpu.texture((self.escaped_size[0], self.escaped_size[1] * BATCH), 2, "f4")
        self.target = gpu.target(self.items, depth=self.depth)
        self.escaped_target = gpu.target(self.escaped)

    def escaped_shares(self, shot: int) -> tuple[float, float]:
        """Shares of what a shot of the batch sends out that leave the scene, and that end on black sides. Waits for the GPU."""
        shares = np.frombuffer(self.escaped.read(), np.float32).reshape(BATCH, -1, 2)[shot].astype(np.float64)
        left, black = shares.sum(0).tolist()
        return left, black

    def release(self) -> None:
        self._gpu.release_all(self.target, self.escaped_target, self.items, self.depth, self.escaped)


class See:
    """The passes that draw and sum visibility maps, for one choice of options. Whoever makes it releases it.

    maps: of the batch; resolution: of a full face [px]; map_size: of one map [px]; slots: GLSL that reads it.
    """

    def __init__(
        self,
        gpu: Gpu,
        occluders: list[Occluders],
        shooters: ShooterBatch,
        options: ShootingOptions,
        resolution: int,
        *,
        lights: Texture | None = None,
    ) -> None:
        """lights: where the shooters are point and spot lights, what these are, see common/light.glsl."""
        self._gpu, self._occluders, self._shooters = gpu, occluders, shooters
        self._projection, self._visibility = PROJECTIONS[options.projection], options.visibility
        self.resolution = resolution
        width, height = self.map_size = self._projection.size(resolution)
        self._most_maps = max(1, min(BATCH, MAPS_TEXELS // (width * height)))
        self.maps = Maps(gpu, self.map_size, 1)
        self._inspected: Maps | None = None
        self.lights, kind = lights, {} if lights is None else {"LIGHT": True}
        pixels: dict[str, object] = {"RESOLUTION": resolution}
        slots = self.slots = {"projection": self._projection.glsl}
        kinds: dict[bool, dict[str, object]] = {
            some.sheer: {"OPACITY": True} if some.sheer else {} for some in occluders
        }
        self._draw = {
            sheer: Pass(
                gpu,
                "solvers/shooting/visibility",
                defines=IN_BLOCKS | pixels | {"VIEWS": self._projection.views} | opacity | kind,
                slots=RECORDS | self._projection.drawing,
            )
            for sheer, opacity in kinds.items()
        }
        self._draw_small = {
            sheer: Pass(
                gpu, "solvers/shooting/small", defines=IN_BLOCKS | pixels | opacity | kind, slots=RECORDS | slots
            )
            for sheer, opacity in kinds.items()
        }
        self._count_small = Pass(
            gpu, "solvers/shooting/small", defines=IN_BLOCKS | pixels | {"COUNT": 1}, slots=RECORDS | slots
        )
        self._add_escaped = (
            Pass(gpu, "solvers/shooting/escaped", defines={"BLOCK": ESCAPED_BLOCK})
            if lights is None
            else Pass(
                gpu,
                "solvers/shooting/light_escaped",
                defines=IN_BLOCKS | pixels | kind | {"BLOCK": ESCAPED_BLOCK},
                slots=RECORDS | slots,
            )
        )
        self._weights = gpu.texture((width // 4, height // 4), 4, "f4")  # see weights.frag.glsl
        target = gpu.target(self._weights)
        Pass(gpu, "solvers/shooting/weights", defines=pixels | kind, slots=slots).draw(target)
        gpu.release_all(target)

    @property
    def textures(self) -> dict[str, Texture]:
        """What a receiver looks its visibility up in."""
        items = {"t_items": self.maps.items}
        lights = {} if self.lights is None else {"t_lights": self.lights}
        return items | lights if self._visibility == "item-id" else items | lights | {"t_depth": self.maps.depth}

    def groups(self, shots: int) -> list[tuple[int, int]]:
        """(first, count) of those shots of a batch that see the scene at once; makes room for their maps."""
        count = min(shots, self._most_maps)
        if count > self.maps.count:
            self.maps.release()
            self.maps = Maps(self._gpu, self.map_size, count)
        return [(first, min(count, shots - first)) for first in range(0, shots, count)]

    def draw(self, first: int, shots: int) -> None:
        """The maps of so many shooters of the batch."""
        self._draw_maps(self.maps, self._shooters.blocks, first, shots)

    def inspect(self, shot: Shot | None) -> Maps:
        """What one shot saw; nothing without one. Drawn into a map beside those of the batch, which may be under way."""
        self._inspected = self._inspected or Maps(self._gpu, self.map_size, 1)
        if shot is None:
            self._inspected.target.clear(OPEN, depth=1.0)
        else:
            self._draw_maps(self._inspected, self._shooters.alone(shot), 0, 1)
        return self._inspected

    def _draw_maps(self, maps: Maps, shooters: Blocks, first: int, shots: int) -> None:
        """All views of so many maps in one draw; what is smaller than a sample in another."""
        used = None if shots == maps.count else (0, 0, maps.items.width, shots * maps.map_size[1])
        maps.target.clear(OPEN, depth=1.0, viewport=used)
        for some in self._occluders:
            casters = self._projection.casters(some, self.resolution)
            self._draw[some.sheer].draw(
                maps.target,
                textures=casters.textures,
                uniforms={"u_maps": maps.count, "u_first": first} | casters.uniforms,
                blocks=shooters,
                mesh=casters.mesh,
                vertices=casters.vertices,
                instances=self._projection.views * shots,
                depth=True,
                clip_distances=self._projection.clip_distances,
            )
        for some in self._occluders:
            self._draw_small[some.sheer].draw(
                maps.target,
                textures={"t_triangles": some.texture} | some.opacity,
                uniforms={"u_maps": maps.count, "u_first": first},
                blocks=shooters,
                vertices=some.count,
                instances=shots,
                points=True,
                depth=True,
            )

    def add_escaped(self, first: int, shots: int) -> None:
        """Add up how much of what these shooters of the batch send out leaves the scene."""
        width, height = self.maps.escaped_size
        lit = self.lights is not None
        self._add_escaped.draw(
            self.maps.escaped_target,
            textures={"t_items": self.maps.items, "t_weights": self._weights}
            | ({"t_depth": self.maps.depth, "t_lights": self.lights} if self.lights is not None else {}),
            uniforms={"u_row": first * height} | ({"u_first": first} if lit else {}),
            blocks=self._shooters.blocks if lit else {},
            viewport=(0, first * height, width, shots * height),
        )

    def count_small(self, shot: Shot) -> int:
        """Triangles that a shot sees, but between the samples of its map: each is drawn as one sample. Waits for the GPU."""
        texture = self._gpu.texture((1, 1), 1, "f4")
        target = self._gpu.target(texture)
        target.clear()
        for some in self._occluders:
            self._count_small.draw(
                target,
                textures={"t_triangles": some.texture},
                uniforms={"u_maps": 1, "u_first": 0},
                blocks=self._shooters.alone(shot),
                vertices=some.count,
                points=True,
                blend="add",
            )
        count = int(np.frombuffer(texture.read(), np.float32)[0])
        self._gpu.release_all(target, texture)
        return count

    def release(self) -> None:
        self.maps.release()
        if self._inspected is not None:
            self._inspected.release()
        self._gpu.release_all(self._weights)
