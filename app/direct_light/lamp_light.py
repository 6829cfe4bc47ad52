"""Direct light of lamps with an area: shadow rays to points on them say which part of them each texel sees [Veach97, 8.2].

    H = E Σ_j F_ij V_ij,    Σ_j F_ij V_ij ≈ Σ_j F_ij · (Σ_k w_k V_k / Σ_k w_k)

w_k is what the point of the k-th shadow ray would give unoccluded, over its probability: with the closed form of Σ F_ij beside it
there is noise in half-shadows only. What is kept is Σ F V, so that another exitance costs no ray.
"""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from app.direct_light.lamps import CELL, NEAR, LampSet, NearLamps, far_chances, lamp_set, lamp_sets
from app.direct_light.lit import A_ROW, PASS, Draw, Kind, Lit, folded
from app.gpu import Gpu, Mesh, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import QUAD_FORMAT, quads
from app.lightmap.tile_pool import Moves
from app.scene.model import Scene
from app.visibility.origins import Origins

SLOTS_AT_ONCE = 256  # of which near lamps are looked up


class LampLight(Kind[LampSet]):
    """What was found of a set is ``seen``; of one with a closed form also ``unoccluded``, Σ F."""

    name = "lamps"
    found = ("seen",)

    def __init__(self, gpu: Gpu, lightmap: Lightmap, rays: dict[str, object], origins: Origins) -> None:
        super().__init__(gpu, lightmap, rays, origins)
        self._shoot = {
            (closed, picture): Pass(
                gpu,
                "direct_light/shadow_rays",
                defines={"CLOSED_FORM": closed, "PICTURE": picture} | self.read_by_rays,
                vertex="common/rects",
            )
            for closed, picture in ((True, False), (False, False), (False, True))
            if not picture or lightmap.pool.emission_tiles is not None
        }
        reads = lightmap.defines("MATERIAL_BITS", "TILE")
        self._unoccluded = Pass(gpu, "direct_light/unoccluded", defines=reads, vertex="common/rects")
        self._add = {
            closed: Pass(
                gpu,
                "direct_light/lamp_light",
                defines={"CLOSED_FORM": closed, "PASS": PASS} | lightmap.defines("TILE"),
                vertex="common/rects",
            )
            for closed in (True, False)
        }

    def reads(self, of: LampSet) -> dict[str, Texture]:
        """The triangles of a set of lamps, and their chances: those of near ones once a slot is looked at."""
        more = {"t_unoccluded": self._cleared(self.lightmap.size, 1)} if of.closed_form else {}
        return {
            "t_lamps": folded(self.gpu, of.rows.reshape(-1, 4)),
            "t_near": self._no_near(),
            "t_far": folded(self.gpu, far_chances(of).reshape(-1, 1)),
        } | more

    def _no_near(self) -> Texture:
        """Room for the near lamps of all cells."""
        pool = self.lightmap.pool
        return self._cleared((A_ROW, -(-pool.tiles * (pool.tile // CELL) ** 2 * NEAR // A_ROW)), 2)

    def _cleared(self, size: tuple[int, int], components: int) -> Texture:
        texture = self.gpu.texture(size, components, "f4")
        target = self.gpu.target(texture)
        target.clear()
        self.gpu.release_all(target)
        return texture

    def kept(self, lit: Lit[LampSet]) -> dict[str, Texture]:
        return lit.found | {"unoccluded": lit.reads["t_unoccluded"]} if lit.of.closed_form else lit.found

    def wanted(self, scene: Scene, known: list[LampSet]) -> list[LampSet]:
        """Of a set that is one material all is known, whatever it emits, also nothing."""
        alone = [of for of in known if len(of.materials) == 1]
        return alone + lamp_sets(self.lightmap.pool, scene, [of.materials[0] for of in alone])

    def same(self, known: LampSet, wanted: LampSet) -> bool:
        return known is wanted or (len(known.materials) > 1 and known.same_light(wanted))

    def emits(self, of: LampSet, scene: Scene) -> bool:
        return bool(of.exitance_in(scene).any())

    def place(self, of: LampSet, scene: Scene) -> list[int]:
        return list(of.materials)

    def at(self, place: list[int], scene: Scene) -> LampSet:
        return lamp_set(self.lightmap.pool, scene, tuple(place))

    def from_afar(self, of: LampSet) -> bool | None:
        return None

    def look(self, lit: Lit[LampSet], slots: NDArray[np.int64]) -> Generator[None, None, None]:
        """Σ F, where it has a closed form, and which lamps are near."""
        pool = self.lightmap.pool
        if lit.of.closed_form:
            target = self.gpu.target(lit.reads["t_unoccluded"])
            corners = pool.corners(slots)
            mesh = Mesh(self.gpu, quads(corners, pool.tile, corners).tobytes(), QUAD_FORMAT, per_instance=True)
            self._unoccluded.draw(
                target,
                textures={"t_lamps": lit.reads["t_lamps"]} | self.origins.textures,
                uniforms={"u_lamps": len(lit.of.rows), "u_size": target.size},
                mesh=mesh,
            )
            self.gpu.release_all(mesh, target)
        yield from self.look_again(lit, slots)

    def look_again(self, lit: Lit[LampSet], slots: NDArray[np.int64]) -> Generator[None, None, None]:
        """Which lamps are near."""
        near = NearLamps(self.lightmap.pool, lit.of)
        for first in range(0, len(slots), SLOTS_AT_ONCE):
            some = np.sort(slots[first : first + SLOTS_AT_ONCE])
            known = near.of(some)
            width = known.shape[1] * NEAR  # of a slot; A_ROW is a multiple of it
            new_row = (np.diff(some, prepend=-2) > 1) | (some * width % A_ROW == 0)
            starts = np.flatnonzero(new_row)
            for start, end in zip(starts.tolist(), [*starts[1:].tolist(), len(some)], strict=True):
                y, x = divmod(int(some[start]) * width, A_ROW)
                lit.reads["t_near"].write(known[start:end].tobytes(), viewport=(x, y, (end - start) * width, 1))
            yield

    def resized(self, lit: Lit[LampSet], moves: Moves) -> None:
        super().resized(lit, moves)
        self.gpu.release_all(lit.reads["t_near"])
        lit.reads["t_near"] = self._no_near()
        lit.looked[:] = False
        if lit.of.closed_form:
            lit.reads["t_unoccluded"] = self.lightmap.moved(lit.reads["t_unoccluded"], moves)

    def shooting(self, lit: Lit[LampSet]) -> Draw:
        uniforms: dict[str, object] = {"u_lamps": len(lit.of.rows)}
        textures = {name: texture for name, texture in lit.reads.items() if name != "t_unoccluded"}
        if lit.of.picture:
            textures |= self.lightmap.textures("t_pages", "t_emission")
            uniforms["u_pages"] = float(self.lightmap.columns), self.lightmap.pool.pages_per_texel
        return Draw(self._shoot[lit.of.closed_form, lit.of.picture], textures, uniforms)

    def adding(self, lit: Lit[LampSet], scene: Scene) -> Draw:
        exitance = lit.of.exitance_in(scene) / self.lightmap.unit
        textures = {"t_shadow_rays": lit.found["seen"]}
        if lit.of.closed_form:
            textures["t_unoccluded"] = lit.reads["t_unoccluded"]
        return Draw(self._add[lit.of.closed_form], textures, {"u_exitance": tuple(exitance.tolist())})


__all__ = ["LampLight"]
