"""The local matrix of multiple reflections, on the GPU: a patch enters or leaves by updates of rank one.

    G = F + FρF + FρFρF + … = F (I - ρF)⁻¹,    H = direct + G ρ direct

is what the paper calls the matrix of several reflections [Shcherbakov19, 3.2], per colour. Stored is what is symmetric by
reciprocity, S_ij = G_ij √(A_i / A_j), and half of it. A node n with form factors f (f_i = F_in √(A_i / A_n), f_n = F_nn) enters,
with ρ that of each node and all vectors and products among the nodes that are there, by

    inverse:  k = f + S ρ f,    σ = f_n + f·ρ k,    S += ρ_n/(1 - ρ_n σ) k kᵀ,    column n = k/(1 - ρ_n σ),  S_nn = σ/(1 - ρ_n σ)
    series:   d = ρ_n f·ρ f,    k = (1 + d)(f + S ρ f),    S += ρ_n k kᵀ,         column n = k,              S_nn = 0

the bordered inverse, and equations 1 to 5 of the paper. It leaves by S -= ρ_n/(1 + ρ_n S_nn) k kᵀ with k its column, which undoes
the first exactly; the paper only clears row and column, and paths through the node stay in the others. They would be counted
twice when it comes again: pairs that were both there when it left are left out then. ``iterate`` keeps the f alone, and
light is reflected in it a few times whenever it is asked for.

Updates wait as vectors, a few of them, until one pass over the matrix adds them all: reading and writing it is what costs.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sized
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.errors import UserError
from app.gpu import Framebuffer, Gpu, Pass, Texture, glsl_constant
from app.scene.model import F32, F64

PENDING = 20  # vectors that wait for one pass over the matrix
SCALE = 256.0  # of what is stored in 16 bits: half floats lose digits below 6e-5
ROW = int(glsl_constant("solvers/local/vector.glsl", "ROW"))  # slots, in a row of a vector's texture
CHUNKS = 16  # into which a product with the matrix is cut, so that enough fragments work on it


class LocalMatrix:
    """Of ``most`` slots, a multiple of ROW. Whoever makes it releases it.

    bounces: how it is kept, one of BOUNCES. memory: bytes on the GPU. Raises UserError where the driver's textures are too small.
    """

    def __init__(self, gpu: Gpu, most: int, bounces: str, bits: int) -> None:
        if most > gpu.limits.max_texture:
            raise UserError(
                f"--patches {most}: textures of this driver have at most {gpu.limits.max_texture} texels a side"
            )
        self._gpu, self.most, self.bounces = gpu, most, bounces
        self.coloured = bounces != "iterate"
        components, dtype = 4 if self.coloured else 1, "f2" if bits == 16 else "f4"
        self.memory = most**2 * components * bits // 8
        self._scale = SCALE if bits == 16 else 1.0
        self._matrix = gpu.texture((most, most), components, dtype)
        self._rows = most // ROW
        self._waiting = gpu.texture((ROW, PENDING * self._rows), 4, "f4")
        self._column, self._given, self._list = (gpu.texture((ROW, self._rows), 4, "f4") for _ in range(3))
        self._sums, self._closed = gpu.texture((PENDING, 1), 4, "f4"), gpu.texture((1, 1), 4, "f4")
        self._partial = gpu.texture((CHUNKS, most), 4, "f4")
        self._targets: dict[Texture, Framebuffer] = {
            t: gpu.target(t)
            for t in (self._matrix, self._waiting, self._column, self._sums, self._closed, self._partial)
        }
        rows = {"VECTOR_ROWS": self._rows}
        self._multiply = Pass(gpu, "solvers/local/multiply", defines=rows)
        self._cross = Pass(gpu, "solvers/local/cross", defines=rows)
        if self.coloured:
            self._look = Pass(gpu, "solvers/local/column", defines=rows)
            self._dot = Pass(gpu, "solvers/local/dots", defines=rows)
            self._close = Pass(gpu, "solvers/local/closed", defines=rows)
            self._wait = Pass(gpu, "solvers/local/wait", defines=rows)
            self._flush = Pass(gpu, "solvers/local/flush", defines=rows)
        self.clear()

    def clear(self) -> None:
        """No node is in it."""
        for target in self._targets.values():
            target.clear()
        self._pending = 0

    # -- nodes that come and go ----------------------------------------------------------------------------------------

    def enter(self, slot: int, kernel: F64, albedo: F64, others: F64, seen: NDArray[np.bool_]) -> None:
        """A node enters a free slot. kernel (most,): f, with each slot; albedo (3,): ρ of it; others (most, 3): ρ of each
        slot, 0 where it is free; seen (most,): whether what is in a slot was there when the node left last."""
        first = np.ones(3)
        listed = np.flatnonzero((kernel != 0) & (np.arange(self.most) != slot))
        if self.bounces == "series":
            first += albedo * ((kernel[listed] ** 2)[:, None] * others[listed]).sum(0)
        given = np.zeros((self.most, 4), np.float32)
        given[:, :3], given[:, 3] = kernel[:, None] * first, 1.0 - seen
        if self.bounces == "series":
            given[slot, :3] = 0.0
        self._given.write(given.tobytes())
        if not self.coloured:
            self._write_cross(slot, self._given, self._closed, exact=False, albedo=np.zeros(3))
            return
        terms = np.zeros((self.most, 4), np.float32)
        terms[: len(listed), :3] = others[listed] * given[listed, :3]
        terms[: len(listed), 3] = listed
        self._list.write(terms.tobytes())
        self._make_room(2)
        count = {"u_count": len(listed)}
        waiting = {"t_waiting": self._waiting, "t_list": self._list}
        if self._pending:
            self._dot.draw(
                self._targets[self._sums], textures=waiting, uniforms=count, viewport=(0, 0, self._pending, 1)
            )
        self._look.draw(
            self._targets[self._column],
            textures=waiting | {"t_matrix": self._matrix, "t_given": self._given, "t_sums": self._sums},
            uniforms=count | {"u_slot": slot, "u_pending": self._pending, "u_scale": 1 / self._scale},
        )
        exact = self.bounces == "inverse"
        self._close.draw(
            self._targets[self._closed],
            textures={"t_column": self._column, "t_given": self._given, "t_list": self._list},
            uniforms=count | {"u_slot": slot},
        )
        known = bool(seen.any()) and not exact
        for masked in (False, True)[: 1 + known]:
            self._push(slot, albedo, enters=True, exact=exact, masked=masked)
        self._write_cross(slot, self._column, self._closed, exact=exact, albedo=albedo)

    def leave(self, slot: int, albedo: F64) -> None:
        """The node in a slot leaves. albedo (3,): ρ, with which it has entered."""
        if self.bounces == "inverse":
            self._make_room(1)
            self._look.draw(
                self._targets[self._column],
                textures={
                    "t_waiting": self._waiting,
                    "t_list": self._list,
                    "t_matrix": self._matrix,
                    "t_given": self._given,
                    "t_sums": self._sums,
                },
                uniforms={"u_slot": slot, "u_pending": self._pending, "u_scale": 1 / self._scale, "u_count": -1},
            )
            self._push(slot, albedo, enters=False, exact=True, masked=False)
        if self.coloured:
            self._forget_waiting(slot)
        self._given.write(bytes(16 * self.most))
        self._write_cross(slot, self._given, self._closed, exact=False, albedo=np.zeros(3))

    def _push(self, slot: int, albedo: F64, *, enters: bool, exact: bool, masked: bool) -> None:
        """Let the column that was just found wait as an update."""
        self._wait.draw(
            self._targets[self._waiting],
            textures={"t_column": self._column, "t_closed": self._closed, "t_given": self._given},
            uniforms={
                "u_slot": slot,
                "u_albedo": tuple(albedo.tolist()),
                "u_enters": enters,
                "u_exact": exact,
                "u_masked": masked,
            },
            viewport=(0, self._pending * self._rows, ROW, self._rows),
        )
        self._pending += 1

    def _forget_waiting(self, slot: int) -> None:
        """Nothing that waits has anything for this slot."""
        target = self._targets[self._waiting]
        target.use()
        for nth in range(self._pending):
            target.clear(viewport=(slot % ROW, nth * self._rows + slot // ROW, 1, 1))

    def _write_cross(self, slot: int, column: Texture, closed: Texture, *, exact: bool, albedo: F64) -> None:
        """Row and column of a slot."""
        for viewport in ((0, slot, slot + 1, 1), (slot, slot, 1, self.most - slot)):
            self._cross.draw(
                self._targets[self._matrix],
                textures={"t_column": column, "t_closed": closed},
                uniforms={
                    "u_slot": slot,
                    "u_albedo": tuple(albedo.tolist()),
                    "u_exact": exact,
                    "u_scale": self._scale,
                },
                viewport=viewport,
            )

    def has_room(self, leave: Sized, enter: Sized) -> bool:
        """Whether so many nodes can leave and enter with no pass over the matrix between."""
        return not self.coloured or self._pending + len(leave) + 2 * len(enter) <= PENDING

    def _make_room(self, vectors: int) -> None:
        """Let so many more vectors wait."""
        if self._pending + vectors > PENDING:
            self.flush()

    def flush(self) -> None:
        """Add all updates that wait."""
        for _ in self.flush_in(1):
            pass

    def flush_in(self, bands: int) -> Iterator[None]:
        """Add all updates that wait, in so many parts: the matrix is to be left alone until the last."""
        if not self._pending:
            return
        edges = (self.most * np.sqrt(np.linspace(0.0, 1.0, bands + 1))).astype(int).tolist()  # parts of the half alike
        for first, last in itertools.pairwise(edges):
            self._flush.draw(
                self._targets[self._matrix],
                textures={"t_waiting": self._waiting},
                uniforms={"u_pending": self._pending, "u_scale": self._scale, "u_texel": 1 / self.most},
                scissor=(0, first, self.most, last - first),
                blend="add",
            )
            yield
        self._pending = 0

    # -- light ---------------------------------------------------------------------------------------------------------

    def multiply(self, vector: Texture) -> Texture:
        """S v, v a vector RGBA32F, as CHUNKS columns that are to be summed (CHUNKS, most) RGBA32F, of 1 / ``scale``."""
        self.flush()
        self._multiply.draw(
            self._targets[self._partial],
            textures={"t_matrix": self._matrix, "t_vector": vector},
            uniforms={"u_most": self.most, "u_coloured": self.coloured, "u_scale": 1 / self._scale},
        )
        return self._partial

    def read(self) -> F32:
        """S (most, most, 3), or (most, most, 1) for ``iterate``. Waits for the GPU."""
        self.flush()
        dtype: Any = np.float16 if self._matrix.dtype == "f2" else np.float32
        raw = np.frombuffer(self._matrix.read(), dtype).reshape(self.most, self.most, -1)
        kept = raw[..., :3].astype(np.float32) / self._scale
        below = np.tril(np.ones((self.most, self.most), bool))[..., None]
        return np.where(below, kept, kept.swapaxes(0, 1))

    def release(self) -> None:
        self._gpu.release_all(*self._targets.values(), *self._targets, self._given, self._list)
