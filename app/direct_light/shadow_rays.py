"""Direct light comes straight from lamps: shadow rays to points on them say which part of them each texel sees [Veach97, 8.2].

    H_direct = Σ_sets E_set Σ_j F_ij V_ij,    Σ_j F_ij V_ij ≈ Σ_j F_ij · (Σ_k w_k V_k / Σ_k w_k)

w_k is what the point of the k-th shadow ray would give unoccluded, over its probability: with the closed form of Σ F_ij beside it
there is noise in half-shadows only. What is kept is Σ F V, so that another exitance costs no ray.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.direct_light.allocate import allocate
from app.direct_light.lamps import LampSet, chances, lamp_set, lamp_sets
from app.direct_light.punctual import LightLit, PunctualLight, light_sets
from app.direct_light.sky_light import SkyLight, SkyLit
from app.gpu import Framebuffer, Gpu, Mesh, Pass, Texture, glsl_constant, keep, take_over
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import QUAD_FORMAT, quads, upload
from app.lightmap.tile_pool import Moves
from app.scene.lights import Light
from app.scene.model import F32, F64, Scene
from app.scene.sky import Sky
from app.util.state import State, StateError
from app.visibility.origins import Origins
from app.visibility.rays import RayScene

PASS = 4  # shadow rays: one sample of the noise
A_ROW = 1 << int(glsl_constant("direct_light/folded.glsl", "FOLD_BITS"))
STREAM = 1  # of random numbers, of the first set


@dataclass
class Lit:
    """What is known of the light of one set. near, far: see Chances, folded. passes: of each slot, of PASS
    shadow rays from each texel."""

    lamps: LampSet
    table: Texture
    near: Texture
    far: Texture
    seen: Texture
    target: Framebuffer
    unoccluded: Texture | None
    stream: int
    passes: NDArray[np.int64]
    passes_table: Texture

    @property
    def kept(self) -> dict[str, Texture]:
        """What shadow rays have found, by name."""
        return {"seen": self.seen} | ({} if self.unoccluded is None else {"unoccluded": self.unoccluded})

    def release(self, gpu: Gpu) -> None:
        optional = [] if self.unoccluded is None else [self.unoccluded]
        gpu.release_all(self.target, self.seen, self.table, self.near, self.far, self.passes_table, *optional)


AnyLit = Lit | SkyLit | LightLit


class DirectLight:
    """On one lightmap: ``light`` holds it [stored units], and in its alpha the variance of the mean of RGB. Whoever makes it
    releases it.

    traced: shadow rays so far, of all texels. count: of a texel to a set, on average.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, rays: RayScene, origins: Origins) -> None:
        self._gpu, self._lightmap, self._rays, self._origins = gpu, lightmap, rays, origins
        self.sets: list[AnyLit] = []
        self._sky: SkyLight | None = None  # where there has been a sky
        self._punctual: PunctualLight | None = None  # where there have been lamps without area
        self.traced = self._streams = 0
        defines = lightmap.defines("MATERIAL_BITS", "TILE")
        self._shoot = {
            (closed, picture): Pass(
                gpu,
                "direct_light/shadow_rays",
                defines={"CLOSED_FORM": closed, "PICTURE": picture, "PASS": PASS} | defines | dict(rays.defines),
                vertex="common/rects",
            )
            for closed, picture in ((True, False), (False, False), (False, True))
            if not picture or lightmap.pool.emission_tiles is not None
        }
        self._unoccluded = Pass(gpu, "direct_light/unoccluded", defines=defines, vertex="common/rects")
        self._add = {
            closed: Pass(
                gpu,
                "direct_light/lamp_light",
                defines={"CLOSED_FORM": closed, "PASS": PASS} | lightmap.defines("TILE"),
                vertex="common/rects",
            )
            for closed in (True, False)
        }
        self._fit()

    def _fit(self) -> None:
        self.light = self._gpu.texture(self._lightmap.size, 4, "f4")
        self._target = self._gpu.target(self.light)
        self._target.clear()

    def add(self, lamps: LampSet) -> None:
        """Another set, none of whose light is known yet."""
        gpu, size = self._gpu, self._lightmap.size
        known = chances(self._lightmap.pool, lamps)
        seen = gpu.texture(size, 4, "f4")
        target = gpu.target(seen)
        target.clear()
        unoccluded = gpu.texture(size, 1, "f4") if lamps.closed_form else None
        stream = self._next_stream()
        table, near = folded(gpu, lamps.rows.reshape(-1, 4)), folded(gpu, known.near.reshape(-1, 2))
        far = folded(gpu, known.far.reshape(-1, 1))
        passes, passes_table = np.zeros(self._lightmap.pool.tiles, np.int64), self._passes_table()
        self.sets.append(Lit(lamps, table, near, far, seen, target, unoccluded, stream, passes, passes_table))

    def _passes_table(self) -> Texture:
        return self._gpu.texture((self._lightmap.columns, self._lightmap.rows), 1, "f4")

    def _look_unoccluded(self, lit: AnyLit, rects: F32) -> None:
        """Σ F of a set with a closed form, in these rectangles."""
        if isinstance(lit, Lit) and lit.unoccluded is not None:
            target = self._gpu.target(lit.unoccluded)
            self._draw(
                self._unoccluded, target, rects, {"t_lamps": lit.table}, {"u_lamps": len(lit.lamps.rows)}, blend=None
            )
            self._gpu.release_all(target)

    def _draw(
        self,
        how: Pass,
        target: Framebuffer,
        rects: F32,
        textures: dict[str, Texture],
        uniforms: dict[str, Any],
        *,
        blend: str | None,
    ) -> None:
        mesh = Mesh(self._gpu, rects.tobytes(), QUAD_FORMAT, per_instance=True)
        how.draw(
            target,
            textures=textures | self._origins.textures,
            uniforms=uniforms | {"u_size": target.size},
            mesh=mesh,
            blend=blend,
        )
        self._gpu.release_all(mesh)

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

    @property
    def _everywhere(self) -> F32:
        return np.array([(0, 0, *self._lightmap.size, 0, 0)], np.float32)

    def drop(self, lit: AnyLit) -> None:
        """Forget a set."""
        self.sets.remove(lit)
        lit.release(self._gpu)

    def shoot(self, count: int, gain: F64 | None = None) -> Generator[None, None, None]:
        """So many shadow rays more from each texel to each set, whole passes of them, in parts; with ``gain`` (slots,) that many
        on average, see allocate.py."""
        texels, each = self._lightmap.pool.slot_texels, max(count // PASS, 1)
        for lit in self.sets:
            if not lit.passes.any():
                self._look_unoccluded(lit, self._everywhere)
            known = np.zeros(len(texels)) if gain is None else gain
            more = allocate(lit.passes, known, texels, each)
            for nth in range(int(more.max(initial=0))):
                self._shoot_at(lit, np.flatnonzero(more > nth), "add")
                yield

    def shoot_from(self, slots: NDArray[np.int64]) -> Generator[None, None, None]:
        """One pass of shadow rays more from the texels of these slots to each set, in parts."""
        for lit in self.sets:
            fresh = slots[lit.passes[slots] == 0]
            if len(fresh):
                corners = self._lightmap.pool.corners(fresh)
                self._look_unoccluded(lit, quads(corners, self._lightmap.pool.tile, corners))
            self._shoot_at(lit, slots, "add")
            yield

    @property
    def fewest(self) -> NDArray[np.int64]:
        """(tiles,) shadow rays that the texels of each slot have had to the set that had fewest."""
        counts = [PASS * lit.passes for lit in self.sets]
        return (
            np.asarray(np.min(counts, axis=0)) if counts else np.full(self._lightmap.pool.tiles, np.iinfo(np.int64).max)
        )

    def _shoot_at(self, lit: AnyLit, slots: NDArray[np.int64], blend: str | None) -> None:
        """One pass of shadow rays from the texels of these slots to a set."""
        pool = self._lightmap.pool
        how, textures, uniforms = self._shooting(lit)
        textures |= {name: texture for name, texture in self._rays.textures.items() if name != "t_bvh_uv"}
        rects = quads(pool.corners(slots), pool.tile, pool.corners(slots))
        self._draw(how, lit.target, rects, textures, uniforms, blend=blend)
        lit.passes[slots] += 1
        self._write_passes(lit)
        self.traced += PASS * int(pool.slot_texels[slots].sum())

    def _shooting(self, lit: AnyLit) -> tuple[Pass, dict[str, Texture], dict[str, Any]]:
        """The program of shadow rays to a set, and what it reads besides origins and rays."""
        if isinstance(lit, SkyLit):
            assert self._sky is not None
            return self._sky.shooting(lit)
        if isinstance(lit, LightLit):
            assert self._punctual is not None
            return self._punctual.shooting(lit)
        textures = {"t_lamps": lit.table, "t_near": lit.near, "t_far": lit.far, "t_passes": lit.passes_table}
        uniforms: dict[str, Any] = {"u_stream": lit.stream, "u_lamps": len(lit.lamps.rows)}
        if lit.lamps.picture:
            textures |= self._lightmap.textures("t_pages", "t_emission")
            uniforms["u_pages"] = float(self._lightmap.columns), self._lightmap.pool.pages_per_texel
        return self._shoot[lit.lamps.closed_form, lit.lamps.picture], textures, uniforms

    def _write_passes(self, lit: AnyLit) -> None:
        table = np.zeros(self._lightmap.columns * self._lightmap.rows, np.float32)
        table[: len(lit.passes)] = lit.passes
        lit.passes_table.write(table.tobytes())

    def shoot_tiles(self, slots: NDArray[np.int64]) -> Iterator[None]:
        """Other leaves are in these slots: as many shadow rays as the others have had on average, in parts."""
        pool = self._lightmap.pool
        rects = quads(pool.corners(slots), pool.tile, pool.corners(slots))
        others = np.setdiff1d(np.flatnonzero(pool.used), slots)
        for lit in self.sets:
            self._look_unoccluded(lit, rects)
            if isinstance(lit, Lit):
                self._know_near(lit, slots)
            known = lit.passes[others] if len(others) else lit.passes[slots]
            wanted = max(int(np.rint(known.mean())), 1)
            lit.passes[slots] = 0
            self._write_passes(lit)
            for nth in range(wanted):
                self._shoot_at(lit, slots, "add" if nth else None)
                yield

    def _know_near(self, lit: Lit, slots: NDArray[np.int64]) -> None:
        """Other leaves are in these slots: which lamps are near to them."""
        for slot, near in zip(slots.tolist(), chances(self._lightmap.pool, lit.lamps, slots).near, strict=True):
            y, x = divmod(slot * near.shape[0] * near.shape[1], A_ROW)
            lit.near.write(near.tobytes(), viewport=(x, y, near.shape[0] * near.shape[1], 1))

    def resized(self, moves: Moves) -> None:
        """The tile pool has got another number of slots."""
        for lit in self.sets:
            if isinstance(lit, SkyLit):
                assert self._sky is not None
                self._sky.resized(lit, moves)
            elif isinstance(lit, LightLit):
                assert self._punctual is not None
                self._punctual.resized(lit, moves)
            else:
                self._resized(lit, moves)
            self._gpu.release_all(lit.passes_table)
            lit.passes, lit.passes_table = moves.array(lit.passes, 0), self._passes_table()
            self._write_passes(lit)
        self._gpu.release_all(self._target, self.light)
        self._fit()

    def _resized(self, lit: Lit, moves: Moves) -> None:
        self._gpu.release_all(lit.target)
        lit.seen = self._lightmap.moved(lit.seen, moves)
        self._gpu.release_all(lit.near)
        lit.near = folded(self._gpu, chances(self._lightmap.pool, lit.lamps).near.reshape(-1, 2))
        lit.target = self._gpu.target(lit.seen)
        if lit.unoccluded is not None:
            lit.unoccluded = self._lightmap.moved(lit.unoccluded, moves)

    def _follow_sky(self, sky: Sky | None) -> None:
        """Another sky, and another sun. Of those that differ by their scale all is known."""
        parts = (
            set()
            if sky is None
            else {sun for sun, emits in ((False, sky.shines), (True, sky.sun is not None)) if emits}
        )
        for lit in [lit for lit in self.sets if isinstance(lit, SkyLit)]:
            if sky is not None and lit.is_sun in parts and lit.knows(sky):
                lit.sky = sky
                parts.discard(lit.is_sun)
            else:
                self.drop(lit)
        for sun in sorted(parts):
            assert sky is not None
            self.sets.append(self._sky_light.lit(sky, self._next_stream(), self._passes_table(), sun=sun))

    @property
    def _sky_light(self) -> SkyLight:
        """Made when it is needed."""
        if self._sky is None:
            self._sky = SkyLight(self._gpu, self._lightmap, dict(self._rays.defines), PASS)
        return self._sky

    def _next_stream(self) -> int:
        """Of random numbers, for another set."""
        self._streams += 1
        return STREAM + self._streams

    def _follow_lights(self, lights: tuple[Light, ...]) -> None:
        """Other lamps without area. Of one that differs by its strength or colour all is known."""
        wanted = light_sets(lights)
        for lit in [lit for lit in self.sets if isinstance(lit, LightLit)]:
            same = next((some for some in wanted if lit.knows(some)), None)
            if same is None:
                self.drop(lit)
            else:
                lit.lights = same
                wanted.remove(same)
        for some in wanted:
            self.sets.append(self._punctual_light.lit(some, self._next_stream(), self._passes_table()))

    @property
    def _punctual_light(self) -> PunctualLight:
        """Made when it is needed."""
        if self._punctual is None:
            self._punctual = PunctualLight(self._gpu, self._lightmap, dict(self._rays.defines), PASS)
        return self._punctual

    def follow(self, scene: Scene) -> None:
        """Materials, the sky, or lamps without area are others. Of a set that is one material all is known, whatever it emits,
        also nothing; another set is lit anew when any of its lamps is another."""
        self._follow_sky(scene.sky if scene.lit_by_sky else None)
        self._follow_lights(scene.lights)
        known = [lit for lit in self.sets if isinstance(lit, Lit)]
        alone = [lit.lamps.materials[0] for lit in known if len(lit.lamps.materials) == 1]
        sets = lamp_sets(self._lightmap.pool, scene, alone)
        for lit in [lit for lit in known if len(lit.lamps.materials) > 1]:
            if any(lit.lamps.same_light(lamps) for lamps in sets):
                sets = [lamps for lamps in sets if not lit.lamps.same_light(lamps)]
            else:
                self.drop(lit)
        for lamps in sets:
            self.add(lamps)

    def catch_up(self, wanted: int) -> Iterator[None]:
        """The shadow rays to sets that came later, until they have had so many on average, in parts."""
        texels = self._lightmap.pool.slot_texels
        for lit in self.sets:
            if not lit.passes.any():
                self._look_unoccluded(lit, self._everywhere)
            missing = wanted - PASS * float(lit.passes @ texels) / max(int(texels.sum()), 1)
            for _ in range(max(int(missing // PASS), 0 if lit.passes.any() else 1)):
                self._shoot_at(lit, np.flatnonzero(texels), "add")
                yield

    def sum(self, scene: Scene, slots: NDArray[np.int64] | None = None) -> None:
        """Bring ``light`` up to date, with what the lamps emit now; in these slots alone where they are given."""
        lit_now = [lit for lit in self.sets if lit.passes.any() and _emits(lit, scene)]
        rects = self._everywhere
        if slots is None or not lit_now:
            self._target.clear()
        else:
            corners = self._lightmap.pool.corners(slots)
            rects = quads(corners, self._lightmap.pool.tile, corners)
        mesh = Mesh(self._gpu, rects.tobytes(), QUAD_FORMAT, per_instance=True)
        for nth, lit in enumerate(lit_now):
            self._add_light(lit, scene, self._target, mesh, "add" if nth else None)
        self._gpu.release_all(mesh)

    def _add_light(self, lit: AnyLit, scene: Scene, target: Framebuffer, mesh: Mesh, blend: str | None) -> None:
        """What one set brings."""
        if not isinstance(lit, Lit):
            if isinstance(lit, SkyLit):
                assert self._sky is not None
                how, textures, uniforms = self._sky.adding(lit, self._origins.normals)
            else:
                assert self._punctual is not None
                how, textures, uniforms = self._punctual.adding(lit)
            how.draw(target, textures=textures, uniforms=uniforms, mesh=mesh, blend=blend)
            return
        exitance = lit.lamps.exitance_in(scene) / self._lightmap.unit
        self._add[lit.lamps.closed_form].draw(
            target,
            textures={"t_shadow_rays": lit.seen, "t_passes": lit.passes_table}
            | ({} if lit.unoccluded is None else {"t_unoccluded": lit.unoccluded}),
            uniforms={"u_exitance": tuple(exitance.tolist()), "u_size": self._lightmap.size},
            mesh=mesh,
            blend=blend,
        )

    def apart(self, scene: Scene, others: Framebuffer, sky: Framebuffer) -> bool:
        """Write the light of all but the sky, and that of the sky as SKY_RAYS rays have gathered it. Whether there is one."""
        lit_now = [lit for lit in self.sets if lit.passes.any() and _emits(lit, scene)]
        skies = [lit for lit in lit_now if isinstance(lit, SkyLit) and not lit.is_sun]
        if not skies:
            return False
        assert self._sky is not None
        mesh = Mesh(self._gpu, self._everywhere.tobytes(), QUAD_FORMAT, per_instance=True)
        others.clear()
        for lit in lit_now:
            if lit not in skies:
                self._add_light(lit, scene, others, mesh, "add")
        _, textures, uniforms = self._sky.adding(skies[0], self._origins.normals)
        self._sky.gathered.draw(sky, textures=textures, uniforms=uniforms, mesh=mesh)
        self._gpu.release_all(mesh)
        return True

    def from_outside(self) -> F64:
        """Power that the sky, the sun and directional lights send to the texels, RGB [W]: their irradiance, as it is known. Waits
        for the GPU."""
        return self._received(
            [s for s in self.sets if isinstance(s, SkyLit) or (isinstance(s, LightLit) and s.from_afar)]
        )

    def from_points(self) -> F64:
        """The same of point and spot lights."""
        return self._received([lit for lit in self.sets if isinstance(lit, LightLit) and not lit.from_afar])

    def _received(self, sets: Sequence[AnyLit]) -> F64:
        parts = [lit for lit in sets if lit.passes.any() and _emits(lit, self._lightmap.scene)]
        if not parts:
            return np.zeros(3)
        gpu, pool = self._gpu, self._lightmap.pool
        alone = gpu.texture(self._lightmap.size, 4, "f4")
        target = gpu.target(alone)
        mesh = Mesh(gpu, self._everywhere.tobytes(), QUAD_FORMAT, per_instance=True)
        for nth, lit in enumerate(parts):
            self._add_light(lit, self._lightmap.scene, target, mesh, "add" if nth else None)
        H = pool.tiles_from_image(np.frombuffer(alone.read(), np.float32).reshape(*self._lightmap.size[::-1], 4))
        gpu.release_all(mesh, target, alone)
        area = np.where(pool.surfaces.face >= 0, pool.surfaces.area, 0.0)
        return np.asarray(np.einsum("tijc,tij->c", H[..., :3].astype(np.float64), area) * self._lightmap.unit)

    # -- kept for later ------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """What shadow rays to all that shines now have found."""
        scene = self._lightmap.scene
        shining = [lit for lit in self.sets if _emits(lit, scene)]
        state = State({"sets": [[*_name_of(lit, scene), lit.stream] for lit in shining]})
        state.values |= {"streams": self._streams, "traced": self.traced}
        for nth, lit in enumerate(shining):
            part = State(arrays={"passes": lit.passes})
            keep(part, **lit.kept)
            state.put(str(nth), part)
        return state

    def restore(self, state: State, scene: Scene) -> None:
        """Know what is in a ``state`` of the same scene, and nothing else; ``sum`` then. Raises StateError."""
        self.forget()
        for nth, (kind, which, stream) in enumerate(state.values["sets"]):
            self._add_named(kind, which, int(stream), scene)
            lit, part = self.sets[-1], state.part(str(nth))
            lit.passes = part.array("passes", np.int64, self._lightmap.pool.tiles).copy()
            self._write_passes(lit)
            take_over(part, **lit.kept)
        self._streams, self.traced = int(state.values["streams"]), int(state.values["traced"])

    def _add_named(self, kind: str, which: list[int], stream: int, scene: Scene) -> None:
        """A set by its name, see _name_of. Raises StateError where the scene has none."""
        if kind == "lamps":
            self.add(lamp_set(self._lightmap.pool, scene, tuple(which)))
            self.sets[-1].stream = stream
        elif kind == "lights":
            lights = tuple(scene.lights[nth] for nth in which)
            self.sets.append(self._punctual_light.lit(lights, stream, self._passes_table()))
        elif scene.sky is not None and (kind == "sky" or scene.sky.sun is not None):
            self.sets.append(self._sky_light.lit(scene.sky, stream, self._passes_table(), sun=kind == "sun"))
        else:
            raise StateError(f"there is no {kind}")

    def forget(self) -> None:
        """No set is known."""
        for lit in list(self.sets):
            self.drop(lit)
        self.traced = self._streams = 0
        self._target.clear()

    def release(self) -> None:
        self.forget()
        self._gpu.release_all(self._target, self.light)


def _name_of(lit: AnyLit, scene: Scene) -> tuple[str, list[int]]:
    """What a set is in the scene: a kind, and numbers of materials or lights."""
    if isinstance(lit, LightLit):
        return "lights", [scene.lights.index(light) for light in lit.lights]
    if isinstance(lit, SkyLit):
        return "sun" if lit.is_sun else "sky", []
    return "lamps", list(lit.lamps.materials)


def _emits(lit: AnyLit, scene: Scene) -> bool:
    if isinstance(lit, LightLit):
        return any(light.emits for light in lit.lights)
    return isinstance(lit, SkyLit) or bool(lit.lamps.exitance_in(scene).any())


def folded(gpu: Gpu, values: F32) -> Texture:
    """A list (n, components) in rows of a texture, see folded.glsl."""
    rows = -(-len(values) // A_ROW)
    table = np.zeros((rows * A_ROW, values.shape[1]), np.float32)
    table[: len(values)] = values
    return upload(gpu, table.reshape(rows, A_ROW, -1))
