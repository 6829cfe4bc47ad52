"""Memory traffic of a shot: what its passes must move at least, and the receiver pass without its arithmetic.

A texel that gets light has H and r read and written once in a draw, and is read itself where it does not follow from its tile's
corner and edges. Maps of visibility are written once and read once. Choosing reads area,
material, H and r of every texel.
"""

from __future__ import annotations

from app.gpu import Gpu, Pass
from app.lightmap.lightmap import LIGHT, Lightmap
from app.solvers.shooting.options import VISIBILITIES
from app.solvers.shooting.solver import Shooting
from app.solvers.shooting.stages import BATCH, BLOCK_BYTES

SHAPED = ("t_position_area", "t_normal_ids")  # of tiles of any shape
CHOSEN = ("t_position_area", "t_normal_ids", "t_irradiance", "t_residual")


class ReceiverTraffic:
    """Reads and blends for the same texels and shots what the receiver pass of a solver does, and computes nothing."""

    def __init__(self, gpu: Gpu, shooting: Shooting) -> None:
        self._gpu, self._shooting = gpu, shooting
        self._passes = {key: self._pass(*key) for key in shooting.stages.receive}
        self._moved: list[float] = []

    def _pass(self, flat: bool, near: bool) -> Pass:
        defines: dict[str, object] = {"FLAT": flat, "NEAR_FIELD": near}
        defines |= {"VISIBILITY": VISIBILITIES.index(self._shooting.options.visibility)}
        defines |= self._shooting.lightmap.defines("MATERIAL_BITS", "ALBEDO_TEXTURE")
        return Pass(self._gpu, "bench/stream", defines=defines, vertex="solvers/shooting/receive")

    def run(self) -> None:
        """For the batch that was chosen last. Waits for the GPU."""
        self._moved.append(sum(self._draw(first, shots) for first, shots in self._shooting.stages.groups(BATCH)))

    def _draw(self, first: int, shots: int) -> float:
        """Bytes that the texels of these shots move."""
        lightmap, moved = self._shooting.lightmap, 0.0
        for (flat, _), stream in self._passes.items():
            if flat not in lightmap.receivers:
                continue
            query = self._gpu.ctx.query(samples=True)
            with query:
                stream.draw(
                    lightmap.light_target,
                    textures=lightmap.textures("t_materials", "t_albedo", *(() if flat else SHAPED))
                    | self._shooting.stages.sight_textures,
                    uniforms={"u_size": lightmap.size, "u_first": first, "u_shots": shots},
                    blocks={"ShooterBlock": (self._shooting.buffers.shooter_blocks, 0, BATCH * BLOCK_BYTES)},
                    mesh=lightmap.receivers[flat],
                    blend="add",
                )
            moved += query.samples * texel_bytes(lightmap, flat=flat)
        return moved

    def moved(self) -> dict[str, float]:
        """Bytes per shot of a batch that each pass must move, by its name: of the receiver pass in the mean of all runs."""
        lightmap, stages = self._shooting.lightmap, self._shooting.stages
        item = 4 * stages.map_size[0] * stages.map_size[1]
        sight = item * len(stages.sight_textures)
        return {
            "choose": sum(lightmap.memory[name] for name in CHOSEN) / BATCH,
            "see": 2.0 * item,  # items and depth, whatever is looked up
            "receive": sum(self._moved) / len(self._moved) / BATCH + sight,
            "look out": float(item),
        }


def texel_bytes(lightmap: Lightmap, *, flat: bool) -> float:
    """That the receiver pass moves for one texel: H and r read and written, and what it reads of the texel itself."""
    width, height = lightmap.size
    surface = lightmap.textures("t_albedo", *(() if flat else SHAPED))
    return sum(lightmap.memory[name] for name in (*LIGHT, *LIGHT, *surface)) / (width * height)
