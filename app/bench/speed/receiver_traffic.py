"""Memory traffic of a shot: what its passes must move at least, and the receiver pass without its arithmetic.

A texel that gets light has H and r read and written once in a draw, and is read itself where it does not follow from its tile's
corner and edges. Maps of visibility are written once and read once. Choosing reads area,
material, H and r of every texel.
"""

from __future__ import annotations

from app.gpu import Gpu, Pass
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import LIGHT
from app.solvers.shooting.inspectable import InspectableShooting
from app.solvers.shooting.options import VISIBILITIES
from app.solvers.shooting.records import BATCH, IN_BLOCKS, RECORDS

GENERAL = ("t_position_area", "t_normal_ids")  # of tiles that are not planar
CHOSEN = ("t_position_area", "t_normal_ids", "t_irradiance", "t_residual")


class ReceiverTraffic:
    """Reads and blends for the same texels and shots what the receiver pass of a solver does, and computes nothing."""

    def __init__(self, gpu: Gpu, shooting: InspectableShooting) -> None:
        self._gpu, self._lightmap, self._batch = gpu, shooting.lightmap, shooting.batch
        self._visibility = VISIBILITIES.index(shooting.options.visibility)
        self._passes = {key: self._pass(*key) for key in self._batch.receive.passes}
        self._moved: list[float] = []

    def _pass(self, planar: bool, near: bool) -> Pass:
        defines: dict[str, object] = {"PLANAR": planar, "NEAR_FIELD": near, "VISIBILITY": self._visibility}
        defines |= IN_BLOCKS | self._lightmap.defines("MATERIAL_BITS", "ALBEDO_TEXTURE")
        return Pass(self._gpu, "bench/stream", defines=defines, slots=RECORDS, vertex="solvers/shooting/receive")

    def run(self) -> None:
        """For the batch that was chosen last. Waits for the GPU."""
        self._moved.append(sum(self._draw(first, shots) for first, shots in self._batch.see.groups(BATCH)))

    def _draw(self, first: int, shots: int) -> float:
        """Bytes that the texels of these shots move."""
        lightmap, batch, moved = self._lightmap, self._batch, 0.0
        for (planar, _), stream in self._passes.items():
            if planar not in batch.receivers.meshes:
                continue
            query = self._gpu.ctx.query(samples=True)
            with query:
                stream.draw(
                    lightmap.light_target,
                    textures=lightmap.textures("t_materials", "t_albedo", *(() if planar else GENERAL))
                    | batch.see.textures,
                    uniforms={"u_size": lightmap.size, "u_first": first, "u_shots": shots},
                    blocks=batch.shooters.blocks,
                    mesh=batch.receivers.meshes[planar],
                    blend="add",
                )
            moved += query.samples * texel_bytes(lightmap, planar=planar)
        return moved

    def moved(self) -> dict[str, float]:
        """Bytes per shot of a batch that each pass must move, by its name: of the receiver pass in the mean of all runs."""
        lightmap, see = self._lightmap, self._batch.see
        item = 4 * see.map_size[0] * see.map_size[1]
        sight = item * len(see.textures)
        return {
            "choose": sum(lightmap.memory[name] for name in CHOSEN) / BATCH,
            "see": 2.0 * item,  # items and depth, whatever is looked up
            "receive": sum(self._moved) / len(self._moved) / BATCH + sight,
            "add escaped": float(item),
        }


def texel_bytes(lightmap: Lightmap, *, planar: bool) -> float:
    """That the receiver pass moves for one texel: H and r read and written, and what it reads of the texel itself."""
    width, height = lightmap.size
    surface = lightmap.textures("t_albedo", *(() if planar else GENERAL))
    return sum(lightmap.memory[name] for name in (*LIGHT, *LIGHT, *surface)) / (width * height)
