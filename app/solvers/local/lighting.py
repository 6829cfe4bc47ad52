"""Lighting: from the direct light on texels, by one product with the matrix, to the indirect light of nodes, and back to texels.

    H_i = x_i + Σ_j G_ij ρ_j x_j,    x_i = 1/N Σ_k B(hit_k) + F_i,outside B_outside,    B = ρ H_direct
    G_ij = S_ij √(A_j / A_i)

The first bounce comes from the very texels that rays of a node hit, since direct light has edges: as its mean over a node, the
light of a sunny side would come from the shaded one, too. One factor brings it to what rays carry away from where they start, so
that no light is made. ``iterate`` sums H = x + F ρ H a few times instead, from the light of the frame before. When nodes come and
go, what is shown becomes what it is now by and by, so that a border that moves is not seen; when lamps change, at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.gpu import Framebuffer, Gpu, Mesh, Pass, ReadBack, Texture
from app.gpu.shader import glsl_constant
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import QUAD_FORMAT, quads, upload
from app.scene.model import F64
from app.solvers.local.matrix import ROW, LocalMatrix
from app.solvers.local.patches import Patches
from app.solvers.local.rows import Rows
from app.visibility.origins import Origins

SWEEPS = 4  # bounces of ``iterate`` whenever it lights
A_ROW = 1 << int(glsl_constant("direct_light/folded.glsl", "FOLD_BITS"))
NODE_VECTORS = 3
COLOURS = 1024  # that tell nodes apart, where they are shown


class Lighting:
    """Of one local set of ``most`` slots. Whoever makes it releases it.

    reflected, first, indirect: the mean of B, the first bounce and H_i of each slot [stored units]; scale: factor of the first
    bounce. outside: B_outside, and in its alpha its share of indirect light. from_outside: share of the indirect light in the set
    that came from outside, as of the last lighting but one.
    """

    def __init__(
        self, gpu: Gpu, lightmap: Lightmap, origins: Origins, patches: Patches, rows: Rows, most: int, edge: int
    ) -> None:
        """edge: of a patch [texels]."""
        self._gpu, self._lightmap, self._origins, self.most, self._edge = gpu, lightmap, origins, most, edge
        self._patches, self._rows, self._places = patches, rows, rows.places
        self._order = folded_u32(gpu, patches.order.astype(np.uint32))
        self._slots = folded_u32(gpu, np.zeros(len(patches.order), np.uint32))
        rows_of: dict[str, object] = {"VECTOR_ROWS": most // ROW}
        self._reflect = Pass(gpu, "solvers/local/reflect", defines=lightmap.defines("MATERIAL_BITS", "ALBEDO_TEXTURE"))
        self._gather = Pass(gpu, "solvers/local/gather", defines=rows_of)
        self._conserve = Pass(gpu, "solvers/local/conserve", defines=rows_of)
        self._send = Pass(gpu, "solvers/local/send", defines=rows_of)
        self._receive = Pass(gpu, "solvers/local/receive", defines=rows_of)
        self._mean = Pass(gpu, "solvers/local/outside", defines=rows_of)
        self._compose = Pass(
            gpu,
            "solvers/local/compose",
            defines=lightmap.defines("TILE", "MATERIAL_BITS") | rows_of,
            vertex="common/rects",
        )
        self._mark = Pass(gpu, "solvers/local/mark", defines=rows_of)
        size = ROW, most // ROW
        self._nodes = gpu.texture((ROW, NODE_VECTORS * size[1]), 4, "f4")
        self._ends, self._uploaded = gpu.texture((rows.rays, most), 2, "u4"), np.full(most, -1)
        self.reflected, self.first, self._carried, self._sent, self.indirect = (
            gpu.texture(size, 4, "f4") for _ in range(5)
        )
        self.outside, self.scale = (gpu.texture((1, 1), 4, "f4") for _ in range(2))
        self._emitted = gpu.texture(self._slots.size, 4, "f4")
        self._targets: dict[Texture, Framebuffer] = {
            t: gpu.target(t) for t in (self._emitted, self._sent, self.indirect, self.outside, self.scale)
        }
        self._gathering = gpu.target(self.reflected, self.first, self._carried)
        self._marks: tuple[Texture, Framebuffer] | None = None
        self._target: Framebuffer | None = None
        self._of: Texture | None = None
        self._reading: ReadBack | None = None
        self.clear()

    def clear(self) -> None:
        """No light."""
        for target in (*self._targets.values(), self._gathering):
            target.clear()
        self._forget_reading()
        self.from_outside = 0.0

    # -- what the set is -----------------------------------------------------------------------------------------------

    def set_nodes(
        self, node: NDArray[np.int64], area: F64, albedo: F64, outside: F64, entered: NDArray[np.int64]
    ) -> None:
        """What is in each slot: node (most,) or -1, area, albedo (most, 3), share of outside, and the piece of
        work in which it entered."""
        patches, there = self._patches, node >= 0
        table = np.zeros((NODE_VECTORS, self.most, 4), np.float32)
        table[0, :, :3], table[0, :, 3] = albedo, np.where(there, area, 0.0)
        table[1, :, 0], table[2, :, 2] = patches.start[node] & 0xFFFF, patches.start[node] >> 16  # exact as floats
        table[1, :, 1] = patches.end[node] - patches.start[node]
        table[1, :, 2] = np.where(there, outside, 0.0)
        table[1, :, 3] = self._edge * np.exp2(patches.level[node].astype(np.float64))
        table[2, :, 0], table[2, :, 1] = patches.level[node], entered
        table[2, :, 3] = node % COLOURS
        self._nodes.write(table.tobytes())
        self._write_ends(node)

    def _write_ends(self, node: NDArray[np.int64]) -> None:
        """Where the rays of what is new in slots start, and what they hit: places in the order."""
        slots = np.flatnonzero((node != self._uploaded) & (node >= 0))
        ends = np.stack([self._rows.starts(node[slots]), self._rows.of(node[slots])], -1).astype(np.uint32)
        for slot, row in zip(slots.tolist(), ends, strict=True):
            self._ends.write(row.tobytes(), viewport=(0, slot, self._rows.rays, 1))
        self._uploaded[slots] = node[slots]

    def set_slots(self, slot_at: NDArray[np.int32]) -> None:
        """In which slot each texel in order is, -1 in none."""
        rows = self._slots.height
        table = np.zeros(rows * A_ROW, np.uint32)
        table[: len(slot_at)] = slot_at + 1
        self._slots.write(table.tobytes())

    # -- light ---------------------------------------------------------------------------------------------------------

    def light(self, matrix: LocalMatrix, direct: Texture, *, other: bool = True, sweeps: int = SWEEPS) -> None:
        """Bring ``indirect`` up to date with the set, and with the direct light on texels where that is another one."""
        nodes = {"t_nodes": self._nodes}
        known = self._lightmap.textures("t_normal_ids", "t_materials", "t_albedo")
        if other:
            self._reflect.draw(
                self._targets[self._emitted], textures=known | {"t_order": self._order, "t_direct": direct}
            )
        ends = {"t_emitted": self._emitted, "t_ends": self._ends, "t_slots": self._slots}
        self._gather.draw(self._gathering, textures=nodes | ends)
        first = {"t_first": self.first}
        self._conserve.draw(
            self._targets[self.scale],
            textures=nodes | first | {"t_carried": self._carried},
            uniforms={"u_most": self.most},
        )
        first |= nodes | {"t_outside": self.outside, "t_scale": self.scale}
        for _ in range(1 if matrix.coloured else sweeps):
            self._send.draw(
                self._targets[self._sent],
                textures=first | {"t_indirect": self.indirect},
                uniforms={"u_anew": matrix.coloured},
            )
            product = matrix.multiply(self._sent)
            self._receive.draw(self._targets[self.indirect], textures=first | {"t_product": product})
        self._mean.draw(
            self._targets[self.outside],
            textures=nodes | {"t_reflected": self.reflected, "t_indirect": self.indirect},
            uniforms={"u_most": self.most},
        )
        if self._reading is not None:
            self.from_outside = float(np.frombuffer(self._reading.take(), np.float32)[3])
        self._reading = ReadBack.of(self._gpu, self._targets[self.outside])

    def compose(self, direct: Texture, tiles: NDArray[np.int64], *, stays: float = 0.0) -> None:
        """Write H of the lightmap in the slots of these tiles, direct and indirect light; a share of what was there stays."""
        lightmap = self._lightmap
        if (irradiance := lightmap.texture("t_irradiance")) is not self._of:
            self._forget_target()
            self._target, self._of = self._gpu.target(irradiance), irradiance
            self._target.color_mask = (True, True, True, False)  # of alpha, which says what stays
        assert self._target is not None
        pool = lightmap.pool
        rects = quads(pool.corners(tiles), pool.tile, pool.corners(tiles))
        mesh = Mesh(self._gpu, rects.tobytes(), QUAD_FORMAT, per_instance=True)
        self._compose.draw(
            self._target,
            mesh=mesh,
            textures=lightmap.textures("t_pages", "t_leaves")
            | {
                "t_origin_normal": self._origins.normals,
                "t_direct": direct,
                "t_places": self._places,
                "t_slots": self._slots,
                "t_nodes": self._nodes,
                "t_indirect": self.indirect,
                "t_outside": self.outside,
            },
            uniforms={
                "u_pages": (float(lightmap.columns), pool.pages_per_texel),
                "u_size": lightmap.size,
                "u_stays": stays,
            },
            blend="keep",
        )
        self._gpu.release_all(mesh)

    def marks(self, now: int) -> Texture:
        """What the local set is, on every texel, see mark.frag.glsl. now: pieces of work so far."""
        if self._marks is None:
            texture = self._gpu.texture(self._lightmap.size, 4, "f4")
            self._marks = texture, self._gpu.target(texture)
        texture, target = self._marks
        known = {"t_places": self._places, "t_slots": self._slots, "t_nodes": self._nodes}
        self._mark.draw(target, textures=known, uniforms={"u_now": float(now)})
        return texture

    def _forget_target(self) -> None:
        if self._target is not None:
            self._gpu.release_all(self._target)
        self._target = self._of = None

    def _forget_reading(self) -> None:
        if self._reading is not None:
            self._reading.take()
            self._reading = None

    def release(self) -> None:
        self._forget_target()
        self._forget_reading()
        if self._marks is not None:
            self._gpu.release_all(*self._marks)
        self._gpu.release_all(*self._targets.values(), *self._targets)
        self._gpu.release_all(self._gathering, self.reflected, self.first, self._carried)
        self._gpu.release_all(self._nodes, self._ends, self._order, self._slots)


def folded_u32(gpu: Gpu, values: NDArray[np.uint32]) -> Texture:
    """A list (n,) in rows of a texture, see folded.glsl."""
    rows = max(-(-len(values) // A_ROW), 1)
    table = np.zeros((rows * A_ROW, 1), np.uint32)
    table[: len(values), 0] = values
    return upload(gpu, table.reshape(rows, A_ROW, 1))
