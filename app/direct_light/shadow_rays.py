"""Direct light comes straight from lamps, from the sky and the sun: shadow rays say how much of them each texel sees.

    H_direct = Σ_sets E_set (F V)_set

All sets get as many shadow rays; what is kept of a set does not follow its strength, so that another one costs no ray.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.direct_light.allocate import allocate
from app.direct_light.lamp_light import LampLight
from app.direct_light.lit import PASS, Draw, Kind, Lit
from app.direct_light.punctual import PunctualLight
from app.direct_light.sky_light import SkyLight
from app.gpu import Framebuffer, Gpu, Mesh, keep, take_over
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import QUAD_FORMAT, quads
from app.lightmap.tile_pool import Moves
from app.scene.model import F32, F64, Scene
from app.util.state import State, StateError
from app.visibility.origins import Origins
from app.visibility.rays import RayScene

STREAM = 1  # of random numbers, of the first set

KINDS: dict[str, type[Kind[Any]]] = {kind.name: kind for kind in (LampLight, SkyLight, PunctualLight)}
AnyLit = Lit[Any]


class DirectLight:
    """On one lightmap: ``light`` holds it [stored units], and in its alpha the variance of the mean of RGB. Whoever makes it
    releases it.

    sets: what is known, see lit.py. traced: shadow rays so far, of all texels. count: of a texel to a set, on average.
    """

    def __init__(
        self, gpu: Gpu, lightmap: Lightmap, rays: RayScene, origins: Origins, *, of_surfaces: bool = True
    ) -> None:
        """of_surfaces: whether surfaces that emit count, too."""
        self._gpu, self._lightmap, self._rays, self._origins = gpu, lightmap, rays, origins
        self._of_surfaces = of_surfaces
        self.sets: list[AnyLit] = []
        self._kinds: dict[str, Kind[Any]] = {}
        self.traced = self._streams = 0
        self._fit()

    def _fit(self) -> None:
        self.light = self._gpu.texture(self._lightmap.size, 4, "f4")
        self._target = self._gpu.target(self.light)
        self._target.clear()

    def _kind(self, name: str) -> Kind[Any]:
        """Made when it is needed. Raises LookupError."""
        if name not in self._kinds:
            self._kinds[name] = KINDS[name](self._gpu, self._lightmap, dict(self._rays.defines), self._origins)
        return self._kinds[name]

    # -- which sets there are --------------------------------------------------------------------------------------------

    def follow(self, scene: Scene) -> None:
        """Materials, the sky, or lamps without area are others: keep the sets of which all is known, drop what is no more, and
        add what is new."""
        names = [LampLight.name] * self._of_surfaces
        names += [SkyLight.name] * (scene.sky is not None) + [PunctualLight.name] * bool(scene.lights_and_sun)
        for kind in (self._kind(name) for name in dict.fromkeys([*self._kinds, *names])):
            lit_of_kind = [lit for lit in self.sets if lit.kind is kind]
            wanted = kind.wanted(scene, [lit.of for lit in lit_of_kind])
            for lit in lit_of_kind:
                same = next((nth for nth, of in enumerate(wanted) if kind.same(lit.of, of)), None)
                if same is None:
                    self.drop(lit)
                else:
                    lit.of = wanted.pop(same)
            for of in wanted:
                self._streams += 1
                self.sets.append(kind.lit(of, STREAM + self._streams))

    def drop(self, lit: AnyLit) -> None:
        """Forget a set."""
        self.sets.remove(lit)
        lit.kind.release(lit)

    # -- shadow rays ---------------------------------------------------------------------------------------------------

    @property
    def count(self) -> float:
        texels = self._lightmap.pool.slot_texels
        cost = max(int(texels.sum()), 1)
        return max((float(PASS * lit.passes @ texels) / cost for lit in self.sets), default=0.0)

    @property
    def known(self) -> bool:
        """Whether every texel has had two passes of shadow rays to each set: from one, nothing is known of its noise."""
        texels = self._lightmap.pool.slot_texels > 0
        return all((lit.passes[texels] > 1).all() for lit in self.sets)

    def shoot(self, count: int, gain: F64 | None = None) -> Generator[None, None, None]:
        """So many shadow rays more from each texel to each set, whole passes of them, in parts; with ``gain`` (slots,) that many
        on average, see allocate.py."""
        texels, each = self._lightmap.pool.slot_texels, max(count // PASS, 1)
        for lit in self.sets:
            known = np.zeros(len(texels)) if gain is None else gain
            more = allocate(lit.passes, known, texels, each)
            yield from self._look(lit, np.flatnonzero(more))
            for nth in range(int(more.max(initial=0))):
                self._shoot_at(lit, np.flatnonzero(more > nth), "add")
                yield

    def shoot_from(self, slots: NDArray[np.int64]) -> Generator[None, None, None]:
        """One pass of shadow rays more from the texels of these slots to each set, in parts."""
        for lit in self.sets:
            yield from self._look(lit, slots)
            self._shoot_at(lit, slots, "add")
            yield

    @property
    def fewest(self) -> NDArray[np.int64]:
        """(tiles,) shadow rays that the texels of each slot have had to the set that had fewest."""
        counts = [PASS * lit.passes for lit in self.sets]
        return (
            np.asarray(np.min(counts, axis=0)) if counts else np.full(self._lightmap.pool.tiles, np.iinfo(np.int64).max)
        )

    def _look(self, lit: AnyLit, slots: NDArray[np.int64]) -> Generator[None, None, None]:
        """Find out what shadow rays from these slots read, where that is not known, in parts."""
        new = slots[~lit.looked[slots]]
        fresh = lit.passes[new] == 0
        if fresh.any():
            yield from lit.kind.look(lit, new[fresh])
        if not fresh.all():
            yield from lit.kind.look_again(lit, new[~fresh])
        lit.looked[new] = True

    def _shoot_at(self, lit: AnyLit, slots: NDArray[np.int64], blend: str | None) -> None:
        """One pass of shadow rays from the texels of these slots to a set."""
        pool, (how, textures, uniforms) = self._lightmap.pool, lit.kind.shooting(lit)
        rays = {name: texture for name, texture in self._rays.textures.items() if name != "t_bvh_uv"}
        corners = pool.corners(slots)
        mesh = Mesh(self._gpu, quads(corners, pool.tile, corners).tobytes(), QUAD_FORMAT, per_instance=True)
        how.draw(
            lit.target,
            textures=textures | rays | self._origins.textures | {"t_passes": lit.passes_table},
            uniforms=uniforms | {"u_stream": lit.stream, "u_size": lit.target.size},
            mesh=mesh,
            blend=blend,
        )
        self._gpu.release_all(mesh)
        lit.passes[slots] += 1
        lit.kind.write_passes(lit)
        self.traced += PASS * int(pool.slot_texels[slots].sum())

    def shoot_tiles(self, slots: NDArray[np.int64]) -> Iterator[None]:
        """Other leaves are in these slots: as many shadow rays as the others have had on average, in parts."""
        others = np.setdiff1d(np.flatnonzero(self._lightmap.pool.used), slots)
        for lit in self.sets:
            yield from lit.kind.look(lit, slots)
            lit.looked[slots] = True
            known = lit.passes[others] if len(others) else lit.passes[slots]
            wanted = max(int(np.rint(known.mean())), 1)
            lit.passes[slots] = 0
            lit.kind.write_passes(lit)
            for nth in range(wanted):
                self._shoot_at(lit, slots, "add" if nth else None)
                yield

    def catch_up(self, wanted: int) -> Iterator[None]:
        """The shadow rays to sets that came later, until they have had so many on average, in parts."""
        texels = self._lightmap.pool.slot_texels
        for lit in self.sets:
            missing = wanted - PASS * float(lit.passes @ texels) / max(int(texels.sum()), 1)
            more = max(int(missing // PASS), 0 if lit.passes.any() else 1)
            if more:
                yield from self._look(lit, np.flatnonzero(texels))
            for _ in range(more):
                self._shoot_at(lit, np.flatnonzero(texels), "add")
                yield

    def resized(self, moves: Moves) -> None:
        """The tile pool has got another number of slots."""
        for lit in self.sets:
            lit.kind.resized(lit, moves)
        self._gpu.release_all(self._target, self.light)
        self._fit()

    # -- what they found -------------------------------------------------------------------------------------------------

    @property
    def _everywhere(self) -> F32:
        return np.array([(0, 0, *self._lightmap.size, 0, 0)], np.float32)

    def _shining(self, scene: Scene) -> list[AnyLit]:
        """What emits now, and of which something is known."""
        return [lit for lit in self.sets if lit.passes.any() and lit.kind.emits(lit.of, scene)]

    def sum(self, scene: Scene, slots: NDArray[np.int64] | None = None) -> None:
        """Bring ``light`` up to date, with what the lamps emit now; in these slots alone where they are given."""
        shining, rects = self._shining(scene), self._everywhere
        if slots is None or not shining:
            self._target.clear()
        else:
            corners = self._lightmap.pool.corners(slots)
            rects = quads(corners, self._lightmap.pool.tile, corners)
        self._add(shining, scene, self._target, rects)

    def _add(self, sets: Sequence[AnyLit], scene: Scene, target: Framebuffer, rects: F32) -> None:
        """Write what these bring to some rectangles of texels."""
        mesh = Mesh(self._gpu, rects.tobytes(), QUAD_FORMAT, per_instance=True)
        for nth, lit in enumerate(sets):
            self._draw(lit, lit.kind.adding(lit, scene), target, mesh, "add" if nth else None)
        self._gpu.release_all(mesh)

    def _draw(self, lit: AnyLit, draw: Draw, target: Framebuffer, mesh: Mesh, blend: str | None) -> None:
        draw.how.draw(
            target,
            textures=draw.textures | {"t_passes": lit.passes_table},
            uniforms=draw.uniforms | {"u_size": self._lightmap.size},
            mesh=mesh,
            blend=blend,
        )

    def apart(self, scene: Scene, others: Framebuffer, sky: Framebuffer) -> bool:
        """Write the light of all but the sky, and that of the sky as SKY_RAYS rays have gathered it. Whether there is one."""
        shining = self._shining(scene)
        for lit in shining:
            if isinstance(lit.kind, SkyLight):
                others.clear()
                self._add([one for one in shining if one is not lit], scene, others, self._everywhere)
                mesh = Mesh(self._gpu, self._everywhere.tobytes(), QUAD_FORMAT, per_instance=True)
                self._draw(lit, lit.kind.gathering(lit, scene), sky, mesh, None)
                self._gpu.release_all(mesh)
                return True
        return False

    def from_outside(self) -> F64:
        """Power that the sky, the sun and directional lights send to the texels, RGB [W]: their irradiance, as it is known. Waits
        for the GPU."""
        return self._received(from_afar=True)

    def from_points(self) -> F64:
        """The same of point and spot lights."""
        return self._received(from_afar=False)

    def _received(self, *, from_afar: bool) -> F64:
        gpu, pool, scene = self._gpu, self._lightmap.pool, self._lightmap.scene
        sets = [lit for lit in self._shining(scene) if lit.kind.from_afar(lit.of) is from_afar]
        if not sets:
            return np.zeros(3)
        alone = gpu.texture(self._lightmap.size, 4, "f4")
        target = gpu.target(alone)
        self._add(sets, scene, target, self._everywhere)
        H = pool.tiles_from_image(np.frombuffer(alone.read(), np.float32).reshape(*self._lightmap.size[::-1], 4))
        gpu.release_all(target, alone)
        area = np.where(pool.surfaces.face >= 0, pool.surfaces.area, 0.0)
        return np.asarray(np.einsum("tijc,tij->c", H[..., :3].astype(np.float64), area) * self._lightmap.unit)

    # -- kept for later ------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """What shadow rays to all that shines now have found."""
        scene = self._lightmap.scene
        shining = [lit for lit in self.sets if lit.kind.emits(lit.of, scene)]
        state = State({"sets": [[lit.kind.name, lit.kind.place(lit.of, scene), lit.stream] for lit in shining]})
        state.values |= {"streams": self._streams, "traced": self.traced}
        for nth, lit in enumerate(shining):
            part = State(arrays={"passes": lit.passes})
            keep(part, **lit.kind.kept(lit))
            state.put(str(nth), part)
        return state

    def restore(self, state: State, scene: Scene) -> None:
        """Know what is in a ``state`` of the same scene, and nothing else; ``sum`` then. Raises StateError."""
        self.forget()
        for nth, (name, place, stream) in enumerate(state.values["sets"]):
            try:
                kind = self._kind(name)
                lit = kind.lit(kind.at(place, scene), int(stream))
            except LookupError as error:
                raise StateError(f"there are no {name}") from error
            self.sets.append(lit)
            part = state.part(str(nth))
            lit.passes = part.array("passes", np.int64, self._lightmap.pool.tiles).copy()
            kind.write_passes(lit)
            take_over(part, **kind.kept(lit))
        self._streams, self.traced = int(state.values["streams"]), int(state.values["traced"])

    def forget(self) -> None:
        """No set is known."""
        for lit in list(self.sets):
            self.drop(lit)
        self.traced = self._streams = 0
        self._target.clear()

    def release(self) -> None:
        self.forget()
        self._gpu.release_all(self._target, self.light)


__all__ = ["DirectLight"]
