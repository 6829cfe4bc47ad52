"""Kept pairs are Kahl's visibility cache: a bit for each two texels, whether they see each other [Kahl22].

V_ij = V_ji: where senders are texels, one bit is kept for both directions. Of n texels that gather from each other these are
n² / 16 bytes.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from app.gpu import Gpu, Pass, Texture, keep, take_over
from app.lightmap.lightmap import Lightmap
from app.solvers.pairs.occlusion import Occlusion
from app.solvers.pairs.pace import Pace
from app.solvers.pairs.senders import Senders
from app.util.state import State

WIDTH = 8192  # words in a row of the texture: 256² texels fill 8193 rows
WORD = 32  # bits


class KeptPairs:
    """Of one table of senders. Whoever makes it releases it.

    words: of 32 pairs. full: whether all of them are found.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, senders: Senders, found_by: Occlusion) -> None:
        self._gpu, self._lightmap, self._senders, self._found_by = gpu, lightmap, senders, found_by
        table = senders.table
        self.words = words_of(table.count, table.senders, table.reciprocal)
        self._width = min(WIDTH, self.words)
        self._bits = gpu.texture((self._width, -(-self.words // self._width)), 1, "u4")
        self._target = gpu.target(self._bits)
        self._find = Pass(
            gpu,
            "solvers/pairs/keep",
            defines=lightmap.defines("MATERIAL_BITS") | found_by.defines,
            slots={"occlusion": found_by.glsl},
        )
        self._next = 0

    @property
    def full(self) -> bool:
        return self._next >= self.words

    @property
    def memory(self) -> int:
        """Bytes on the GPU."""
        return 4 * self._bits.width * self._bits.height

    @property
    def occlusion(self) -> Occlusion:
        """How the passes that gather look pairs up."""
        return Occlusion("solvers/pairs/by_bits.glsl", textures={"t_bits": self._bits}, uniforms=self._layout)

    @property
    def _layout(self) -> dict[str, Any]:
        table = self._senders.table
        return {"u_senders": table.senders, "u_reciprocal": int(table.reciprocal), "u_width": self._width}

    def fill(self, pace: Pace) -> Iterator[None]:
        """Find out what is not known yet, in parts."""
        while not self.full:
            row, column = divmod(self._next, self._width)
            words = max(pace.pairs // WORD, 1)
            if column == 0 and words >= self._width:
                rows = min(words // self._width, self._bits.height - row)
                area, done = (0, row, self._width, rows), rows * self._width
            else:
                done = min(words, self._width - column)
                area = (column, row, done, 1)
            with pace.timed(done * WORD):
                self._find.draw(
                    self._target,
                    textures=self._lightmap.textures("t_position_area", "t_normal_ids", "t_facets")
                    | self._senders.some("t_texels", "t_place", "t_facing")
                    | self._found_by.textures,
                    uniforms=self._layout | {"u_words": self.words} | self._found_by.uniforms,
                    viewport=area,
                )
            self._next += done
            yield

    def state(self) -> State:
        """What was found so far."""
        state = State({"next": self._next})
        keep(state, bits=self._bits)
        return state

    def restore(self, state: State) -> None:
        """Know what is in a ``state``. Raises StateError."""
        take_over(state, bits=self._bits)
        self._next = int(state.values["next"])

    @property
    def textures(self) -> dict[str, Texture]:
        return {"t_bits": self._bits}

    def release(self) -> None:
        self._gpu.release_all(self._target, self._bits)


def words_of(texels: int, senders: int, reciprocal: bool) -> int:
    """See solvers/pairs/bits.glsl."""
    each = -(-senders // WORD)
    if not reciprocal:
        return texels * each
    q, rest = divmod(senders, WORD)
    return (q + 1) * (16 * q + rest) + (texels - senders) * each
