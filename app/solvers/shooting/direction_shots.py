"""Direction shots light all texels from one direction of the sky, of the sun, or of a directional light, by a map in parallel
projection.

    ΔH_j = E_k cos θ V_kj,    Δr_j = ρ_j ΔH_j

Works badly where a texel is far smaller than a pixel of the map, which is as wide as the scene; what is smaller than a pixel may
be missed.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence

import numpy as np

from app.gpu import Framebuffer, Mesh, Pass, Texture
from app.scene.sky_directions import axes_of
from app.solvers.shooting.choose import band_of
from app.solvers.shooting.equipment import Equipment
from app.solvers.shooting.ledger import Ledger
from app.solvers.shooting.outside_sources import SUNS, OutsideShot, places_edge
from app.solvers.shooting.records import BATCH, BLOCK_ROWS, IN_BLOCKS, OPEN, RECORDS, SHOOTER
from app.solvers.shooting.see import MAPS_TEXELS

# px along the edge of a map, for each of a full face of a patch's map: a texel is at least one sample there, and two here, since
# one direction of a sharp sun casts an edge by itself
PER_FACE_PIXEL = 2
MARGIN = 4  # px of a map that the sphere around the scene leaves free, both sides together
SENT_BLOCK = 32  # samples along the edge of a block that direction_sent.frag.glsl sums


class DirectionShots:
    """What makes them, with maps that fit the resolution of a patch's [px]. Whoever makes it releases it."""

    def __init__(self, equipment: Equipment, resolution: int) -> None:
        gpu, lightmap, occluders = equipment.gpu, equipment.lightmap, equipment.occluders
        self._gpu, self._lightmap, self._occluders, self._shooters = gpu, lightmap, occluders, equipment.shooters
        pixels = self._pixels = PER_FACE_PIXEL * resolution
        self._most_maps = max(1, min(BATCH, MAPS_TEXELS // pixels**2))
        defines: dict[str, object] = {"PIXELS": pixels, "MARGIN": MARGIN, **IN_BLOCKS}
        kinds: dict[bool, dict[str, object]] = {one.sheer: {"OPACITY": True} if one.sheer else {} for one in occluders}
        self._draw = {
            sheer: Pass(gpu, "solvers/shooting/direction_map", defines=defines | more, slots=RECORDS)
            for sheer, more in kinds.items()
        }
        reads = lightmap.defines("MATERIAL_BITS", "ALBEDO_TEXTURE", "TILE")
        reads |= {"MANY_EDGE": places_edge(SUNS, lightmap.scene)}
        self._receive, self._receive_rects = (
            Pass(gpu, "solvers/shooting/direction_receive", defines=defines | reads, slots=RECORDS, vertex=vertex)
            for vertex in ("common/fullscreen", "common/rects")
        )
        self._items = gpu.texture((pixels, pixels * self._most_maps), 1, "f4")
        self._depth = gpu.depth_texture(self._items.size)
        self._target = gpu.target(self._items, depth=self._depth)
        self._count = Pass(gpu, "solvers/shooting/direction_sent", defines={"BLOCK": SENT_BLOCK})
        blocks = self._blocks = pixels // SENT_BLOCK
        self._sent = gpu.texture((blocks, blocks * BATCH), 1, "f4")
        self._sent_target = gpu.target(self._sent)

    def shoot(self, shots: Sequence[OutsideShot], ledger: Ledger, bands: int) -> Generator[None, None, None]:
        """These, up to a batch, in parts."""
        self._write(shots)
        for first, some in self._groups(len(shots)):
            self._draw_maps(first, some)
            self._count_sent(first, some)
            yield
            for band in range(bands):
                self._receive.draw(
                    self._lightmap.light_target,
                    textures=self._reads,
                    uniforms={"u_shots": some, "u_first": first, "u_maps": self._most_maps},
                    blocks=self._shooters.blocks,
                    blend="add",
                    scissor=band_of(self._lightmap.size, band, bands),
                )
                yield
        ledger.enter_directions(self._sent, len(shots), (2.0 / (self._pixels - MARGIN)) ** 2)

    def replay(self, shots: Sequence[OutsideShot], target: Framebuffer, rects: Mesh) -> Generator[None, None, None]:
        """Add these once more to a target, on some rectangles of texels only, in parts."""
        self._write(shots)
        for first, some in self._groups(len(shots)):
            self._draw_maps(first, some)
            yield
            self._receive_rects.draw(
                target,
                textures=self._reads,
                uniforms={"u_shots": some, "u_first": first, "u_maps": self._most_maps, "u_size": self._lightmap.size},
                blocks=self._shooters.blocks,
                mesh=rects,
                blend="add",
            )
            yield

    @property
    def _reads(self) -> dict[str, Texture]:
        reads = "t_position_area", "t_normal_ids", "t_materials", "t_albedo", "t_facets", "t_leaves"
        return self._lightmap.textures(*reads) | {"t_items": self._items, "t_depth": self._depth}

    def _groups(self, shots: int) -> list[tuple[int, int]]:
        """(first, count) of those that see the scene at once."""
        return [(first, min(self._most_maps, shots - first)) for first in range(0, shots, self._most_maps)]

    def _draw_maps(self, first: int, shots: int) -> None:
        pixels = self._pixels
        self._target.clear(OPEN, depth=1.0, viewport=(0, 0, pixels, pixels * shots))
        for some in self._occluders:
            casters = some.whole(pixels)
            self._draw[some.sheer].draw(
                self._target,
                textures=casters.textures,
                uniforms={"u_first": first, "u_maps": self._most_maps} | casters.uniforms,
                blocks=self._shooters.blocks,
                mesh=casters.mesh,
                instances=shots,
                depth=True,
            )

    def _count_sent(self, first: int, shots: int) -> None:
        """Count the samples of the maps that were drawn last that show sides with texels."""
        place = 0, first * self._blocks, self._blocks, shots * self._blocks
        items = {"t_items": self._items}
        self._count.draw(self._sent_target, textures=items, uniforms={"u_row": place[1]}, viewport=place)

    def _write(self, shots: Sequence[OutsideShot]) -> None:
        """Write these shots as the shooters of the batch."""
        records = np.zeros(BATCH, SHOOTER.dtype)
        for record, shot in zip(records, shots, strict=False):
            record["edge_u"], record["edge_v"] = axes_of(shot.axis)
            record["normal"] = shot.axis
            record["exitance"] = shot.light / self._lightmap.unit
            record["patch_y"], record["signed_size"] = shot.place, 1
        self._shooters.texture.write(SHOOTER.write(records, BLOCK_ROWS))
        self._shooters.share()

    def release(self) -> None:
        self._gpu.release_all(self._target, self._items, self._depth, self._sent_target, self._sent)


__all__ = ["DirectionShots"]
