"""A lit set is what is known of the light of some lamps that are looked at together; its kind says how it is found and shown.

There are three kinds: lamps with an area, lamps without one and the sun, and the sky. For each kind a set differs, and so do the
programs; all else is the same, see shadow_rays.py.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Generator
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.gpu import Framebuffer, Gpu, Pass, Texture, glsl_constant
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import upload
from app.lightmap.tile_pool import Moves
from app.scene.model import F32, Scene
from app.visibility.origins import Origins

PASS = 4  # shadow rays: one sample of the noise
A_ROW = 1 << int(glsl_constant("direct_light/folded.glsl", "FOLD_BITS"))

SetT = TypeVar("SetT")


class Draw(NamedTuple):
    """A program, and what it reads besides what it reads of all sets."""

    how: Pass
    textures: dict[str, Texture]
    uniforms: dict[str, Any]


@dataclass(eq=False)
class Lit(Generic[SetT]):
    """of: the set. kind: what it is one of. found: what shadow rays have found, by name, as ``target`` has it. stream: of random
    numbers. passes: of each slot, of PASS shadow rays from each texel. reads: what its shadow rays read, its own. looked: at each
    slot, for what they read of it."""

    of: SetT
    kind: Kind[SetT]
    found: dict[str, Texture]
    target: Framebuffer
    stream: int
    passes: NDArray[np.int64]
    passes_table: Texture
    looked: NDArray[np.bool_]
    reads: dict[str, Texture] = field(default_factory=dict)


class Kind(ABC, Generic[SetT]):
    """One kind of sets on one lightmap."""

    name: str
    found: tuple[str, ...] = ("seen", "all")  # see rays_loop.glsl

    def __init__(self, gpu: Gpu, lightmap: Lightmap, rays: dict[str, object], origins: Origins) -> None:
        """rays: defines of visibility/rays.glsl; origins: where they start."""
        self.gpu, self.lightmap, self.origins = gpu, lightmap, origins
        self.read_by_rays = lightmap.defines("MATERIAL_BITS", "TILE") | {"PASS": PASS} | rays

    def lit(self, of: SetT, stream: int) -> Lit[SetT]:
        """A set of which nothing is known yet."""
        size = self.lightmap.size
        found = {name: self.gpu.texture(size, 4, "f4") for name in self.found}
        target = self.gpu.target(*found.values())
        target.clear()
        passes = np.zeros(self.lightmap.pool.tiles, np.int64)
        return Lit(of, self, found, target, stream, passes, self._passes_table(), passes > 0, self.reads(of))

    def _passes_table(self) -> Texture:
        return self.gpu.texture((self.lightmap.columns, self.lightmap.rows), 1, "f4")

    def write_passes(self, lit: Lit[SetT]) -> None:
        table = np.zeros(self.lightmap.columns * self.lightmap.rows, np.float32)
        table[: len(lit.passes)] = lit.passes
        lit.passes_table.write(table.tobytes())

    def resized(self, lit: Lit[SetT], moves: Moves) -> None:
        """The tile pool has got another number of slots."""
        self.gpu.release_all(lit.target, lit.passes_table)
        lit.found = {name: self.lightmap.moved(texture, moves) for name, texture in lit.found.items()}
        lit.target = self.gpu.target(*lit.found.values())
        lit.passes, lit.passes_table = moves.array(lit.passes, 0), self._passes_table()
        lit.looked = moves.array(lit.looked, False)
        self.write_passes(lit)

    def kept(self, lit: Lit[SetT]) -> dict[str, Texture]:
        """What is to be kept of it, by name."""
        return lit.found

    def release(self, lit: Lit[SetT]) -> None:
        self.gpu.release_all(lit.target, lit.passes_table, *lit.found.values(), *lit.reads.values())

    def look(self, lit: Lit[SetT], slots: NDArray[np.int64]) -> Generator[None, None, None]:
        """Find out what can be known without a ray, in slots that have had none, or hold other leaves; in parts."""
        yield from self.look_again(lit, slots)

    def look_again(self, lit: Lit[SetT], slots: NDArray[np.int64]) -> Generator[None, None, None]:
        """The same of what is not kept."""
        yield from ()

    @abstractmethod
    def reads(self, of: SetT) -> dict[str, Texture]:
        """What shadow rays to a set read, its own."""

    @abstractmethod
    def wanted(self, scene: Scene, known: list[SetT]) -> list[SetT]:
        """The sets of a scene, where these are known."""

    @abstractmethod
    def same(self, known: SetT, wanted: SetT) -> bool:
        """Whether all that was found of one holds for the other as well."""

    @abstractmethod
    def emits(self, of: SetT, scene: Scene) -> bool: ...

    @abstractmethod
    def place(self, of: SetT, scene: Scene) -> list[int]:
        """Which it is in the scene."""

    @abstractmethod
    def at(self, place: list[int], scene: Scene) -> SetT:
        """The set at a ``place``. Raises LookupError where there is none."""

    @abstractmethod
    def from_afar(self, of: SetT) -> bool | None:
        """Whether its light comes from beyond all surfaces; None where a surface sends it."""

    @abstractmethod
    def shooting(self, lit: Lit[SetT]) -> Draw:
        """Shadow rays, which read ``reads``, origins and rays."""

    @abstractmethod
    def adding(self, lit: Lit[SetT], scene: Scene) -> Draw:
        """The sum of what they found."""


def folded(gpu: Gpu, values: F32) -> Texture:
    """A list (n, components) in rows of a texture, see folded.glsl."""
    rows = -(-len(values) // A_ROW)
    table = np.zeros((rows * A_ROW, values.shape[1]), np.float32)
    table[: len(values)] = values
    return upload(gpu, table.reshape(rows, A_ROW, -1))


__all__ = ["A_ROW", "PASS", "Draw", "Kind", "Lit", "folded"]
