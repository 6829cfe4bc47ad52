"""The local matrix lights what is around the observer, in a world too large to solve at once [Shcherbakov19].

    H = direct + G ρ direct

Direct light is found on all texels by shadow rays, nearest first; what it becomes by reflection is one product with the matrix of
all reflections among the nodes of the local set (matrix.py, lighting.py). As the observer walks, nodes enter and leave
(selection.py), a few in each piece of work, whose form factors come from rays that are traced once (rows.py, form_factors.py).
Another lamp costs a product; another albedo lets nodes enter anew, one after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.direct_light.shadow_rays import DirectLight
from app.errors import UserError
from app.gpu import Gpu, Texture
from app.lightmap.lightmap import Lightmap
from app.scene.lights import Light
from app.scene.model import F64, Material
from app.scene.sky import Sky
from app.solvers.base import EnergyBalance, Inspection, Progress
from app.solvers.local.balance import balance_of, matrix_error
from app.solvers.local.exchange import Exchange
from app.solvers.local.form_factors import LocalSet
from app.solvers.local.inspectable import facts_of, figures_of, note_of
from app.solvers.local.lighting import Lighting
from app.solvers.local.matrix import LocalMatrix
from app.solvers.local.members import Members
from app.solvers.local.openness import openness_of
from app.solvers.local.options import LocalOptions
from app.solvers.local.patches import patches_of
from app.solvers.local.relighting import Relighting
from app.solvers.local.rows import Rows, rows_in
from app.solvers.local.selection import Swap
from app.solvers.local.size import fitting, size_of_set
from app.solvers.local.tiles import Tiles, first_eye
from app.util.parts import UnderWay, run_to_end
from app.util.state import State
from app.visibility.origins import Origins
from app.visibility.rays import RayScene

I64 = NDArray[np.int64]
FADE, FADED = 0.75, 16  # share of what was shown that stays in each picture after nodes came and went, and for how many
FLUSH_PARTS = 3  # of the pass over the matrix that all updates wait for: whole, it takes a third of a frame
MOST_ALBEDO = 0.9999  # in a closed room of 1 light never ends, and its matrix has no inverse
SOON = 16  # shadow rays to what is new, before an edit is shown; the rest comes with the next pieces of work
BATCH = 64


class Local:
    """Lights one lightmap around the observer. Whoever makes it releases it.

    issued: nodes that have entered the set so far. Raises UserError for a set that does not fit, and for quadtrees.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, options: LocalOptions) -> None:
        if lightmap.refinement is not None:
            raise UserError("the local matrix needs uniform texels: its patches are squares of them")
        self.gpu, self.lightmap = gpu, lightmap
        self.rays, self.origins = RayScene(gpu, lightmap.pool), Origins(gpu, lightmap)
        self.direct = DirectLight(gpu, lightmap, self.rays, self.origins)
        self._tiles = Tiles(lightmap.pool, lightmap.space.local_from_world(first_eye(lightmap)))
        self._parts: list[Any] = []
        self._under_way = UnderWay()
        self._fading = self.issued = 0
        # whether lamps are others, change in every piece of work, and direct light is known of all tiles as they are now
        self._edited, self._editing, self._all_known = False, False, True
        self._escaped, self._error = np.zeros(3), 0.0
        try:
            self._build(options)
        except UserError:
            self.release()
            raise
        self.reset()

    def _build(self, options: LocalOptions) -> None:
        """Patches, rows and matrix of these options."""
        gpu, lightmap = self.gpu, self.lightmap
        level, most = size_of_set(gpu, lightmap.pool, options)
        patches = patches_of(lightmap.pool, level, lambda at: openness_of(gpu, lightmap, self.rays, self.origins, at))
        most = fitting(most, patches.count, options)
        rows_in(options.row_memory, options.rays, most)  # before anything is released
        matrix = LocalMatrix(gpu, most, options.bounces, options.bits)
        self._release_parts()
        self._parts.append(matrix)
        rows = Rows(gpu, lightmap, self.rays, self.origins, patches, options.rays, options.row_memory, most)
        self._parts.append(rows)
        lighting = Lighting(gpu, lightmap, self.origins, patches, rows, most, 2**level)
        self._parts.append(lighting)
        self.options, self.patches, self.rows, self.lighting, self.level = options, patches, rows, lighting, level
        self.set, self.matrix = LocalSet(patches, rows, most), matrix
        self.members = Members(self.set, matrix, self._albedo())
        self._relighting = Relighting(lighting, matrix, self.set, self.members)
        self.exchange = Exchange(patches, rows, self.set, self.members, matrix)

    # -- work ----------------------------------------------------------------------------------------------------------

    def work(self, amount: int, bands: int = 1) -> Generator[None, None, int]:
        """What a frame has time for: nodes that enter and leave, at most as many as the options say, or shadow rays; and the
        light of both, however much ``amount`` is. Returns how many nodes have entered."""
        self._under_way.finish()
        return self._under_way.begin(self._piece(bands))

    def _piece(self, bands: int) -> Generator[None, None, int]:
        if self._edited:
            goes_on = self._editing
            yield from self._follow_edit()
            if not goes_on:
                return 0
        else:
            if self._editing and not self._all_known:
                self.direct.sum(self.lightmap.scene)
                self._relighting.changed()
            self._editing, self._all_known = False, True
        entered = 0
        self.members.pieces += 1
        tiles = self._tiles.next_to_shoot(self.direct, self.options.shadow_rays)
        if self._tiles.dark_near(self.direct):
            yield from self._shoot(tiles, bands)
        else:
            yield from self.exchange.make_rows()
            if plan := self.exchange.plan():
                entered = yield from self._swap(plan, bands)
            elif len(tiles):
                yield from self._shoot(tiles, bands)
        if self._edited:
            yield from self._follow_edit()
            return entered
        self._relighting.go_on(self.direct.light)
        yield
        self._fading = FADED if entered else max(self._fading - 1, 0)
        self._compose(all_=self._fading == 0, stays=FADE if self._fading else 0.0)
        return entered

    def _shoot(self, tiles: I64, bands: int) -> Generator[None, None, None]:
        """One pass of shadow rays more from these tiles."""
        for some in np.array_split(tiles, min(bands, len(tiles))):
            yield from self.direct.shoot_from(some)
        self.direct.sum(self.lightmap.scene, tiles)
        self._relighting.changed()

    def _compose(self, *, all_: bool, stays: float = 0.0) -> None:
        """Write the light that is shown; if not all of it, that which is near, and some of the rest in turn. stays: share of what
        was shown before."""
        self.lighting.compose(self.direct.light, self._tiles.all if all_ else self._tiles.in_turn(), stays=stays)

    def _follow_edit(self) -> Generator[None, None, None]:
        """The light of other lamps, in one piece of work; of lamps that change in every picture, what is near, and some of the
        rest in turn, until they stay as they are."""
        goes_on, self._edited = self._editing, False
        self._editing = True
        self.direct.follow(self.lightmap.scene)
        yield from self.direct.catch_up(min(SOON, self.options.shadow_rays))
        tiles = self._tiles.in_turn() if goes_on else self._tiles.all
        self.direct.sum(self.lightmap.scene, tiles)
        self._all_known = not goes_on
        self._relighting.changed()
        self._relighting.go_on(self.direct.light)
        self.lighting.compose(self.direct.light, tiles)

    def _swap(self, plan: list[Swap], bands: int) -> Generator[None, None, int]:
        """Nodes enter and leave, less of them where an edit waits for it to end."""
        entered = yield from self.exchange.swap(plan, self.options.swaps, lambda: self._edited)
        self.issued += entered
        if self.options.bounces == "series" and self.members.left > self.set.most:
            self._fill_anew()  # paths through nodes that left pile up
        yield from self.matrix.flush_in(FLUSH_PARTS * bands)
        self.lighting.set_slots(self.set.slot_at)
        self._relighting.changed(direct=False)
        return entered

    # -- how far it is -------------------------------------------------------------------------------------------------

    def poll(self, *, wait: bool = False) -> Progress:
        """How much of the set and of the shadow rays is still to come."""
        if wait:
            self._under_way.finish()
        emits = self.lightmap.scene.emits
        wanted = max(len(self.wanted), 1)
        here = self.to_come / wanted
        shadow = 0.0
        if self.direct.sets:
            some = self.lightmap.pool.slot_texels > 0
            asked = self.options.shadow_rays
            shadow = 1 - float(np.minimum(self.direct.fewest[some], asked).mean()) / asked
        missing = max(here, shadow, self.members.waiting / wanted) if emits else 0.0
        known = self.members.settled and self._fading == self._relighting.left == 0
        followed = not self._edited and self._all_known
        dark = not emits and not self.issued
        done = followed and (dark or (missing <= self.options.missing and known))
        remaining = missing if self.issued or not emits else 1.0
        note = note_of(self._error, self.matrix, self.options)
        return Progress(self.issued, remaining, self._escaped, converged=done, note=note)

    def settle(self) -> Progress:
        """End the work under way, and wait for the GPU."""
        self.poll(wait=True)
        self._look_for_error()
        return self.poll()

    def _look_for_error(self) -> None:
        """By how much the matrix is off, once its light is that of the set as it is."""
        found = self.to_come == 0 and self.members.settled and self._relighting.done
        self._error = matrix_error(self.lighting, self.members) if found else 0.0

    def energy(self) -> EnergyBalance:
        """Where all light is now, RGB [W]. Reads every texel and waits for the GPU."""
        self._under_way.finish()
        balance = balance_of(self.lightmap, self.direct, self.patches, self.members)
        self._look_for_error()
        if not self.issued and self.lightmap.scene.emits:
            return replace(balance, escaped=np.zeros(3), unshot=balance.emitted)
        self._escaped = balance.escaped
        return balance

    # -- beginning, and other options ----------------------------------------------------------------------------------

    def reset(self) -> None:
        """Forget all light, and let the set be filled anew. Rows stay: they follow from the scene alone."""
        self._under_way.drop()
        self.lightmap.clear()
        self.members.albedo = self._albedo()
        self.members.clear()
        self.lighting.clear()
        self.lighting.set_slots(self.set.slot_at)
        self.direct.forget()
        self.direct.follow(self.lightmap.scene)
        self._edited, self._editing, self._all_known = False, False, True
        self._fading = self.issued = 0
        self._relighting.forget()
        self._escaped, self._error = np.zeros(3), 0.0
        self._look()

    def set_options(self, options: LocalOptions) -> None:
        """Use other knobs: those that the matrix or its rows follow from begin again. Raises UserError, and keeps what it has."""
        self._under_way.finish()
        built = ("bounces", "patches", "patch_level", "rays", "bits", "matrix_memory")
        if any(getattr(options, name) != getattr(self.options, name) for name in built):
            self._build(options)
            self.reset()
        else:
            self.rows.set_memory(options.row_memory, self.set.most)
            self.options = options
            self._look()
            self.rows.make_room(0, self.exchange.needed)

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        """Other albedos and emissions: the light of other lamps with the next piece of work; of other albedos, while nodes enter
        the set anew."""
        before = [m.albedo for m in self.lightmap.scene.materials]
        self.lightmap.set_materials(materials)
        if not self.issued:
            self.reset()
            return
        self._edited = True
        self._under_way.finish()  # soon, and with the light of the edit
        if [m.albedo for m in materials] != before:
            self.members.albedo, self._edited = self._albedo(), True
            self.members.look_again()
            if self.options.bounces == "series":
                self._fill_anew()  # paths with the old albedo would stay

    def set_sky(self, sky: Sky | None) -> None:
        """Another sky: its light with the next piece of work."""
        self.lightmap.set_sky(sky)
        self._follow_scene()

    def set_lights(self, lights: tuple[Light, ...]) -> None:
        """Other lamps without area: their light with the next piece of work."""
        self.lightmap.set_lights(lights)
        self._follow_scene()

    def _follow_scene(self) -> None:
        if self.issued:
            self._edited = True
            self._under_way.finish()
        else:
            self.reset()

    def _fill_anew(self) -> None:
        """Take all nodes out: they enter with the next pieces of work."""
        self.members.clear()
        self.lighting.set_slots(self.set.slot_at)
        self.exchange.first = True
        self._relighting.changed()

    def _albedo(self) -> F64:
        """(nodes, 3) of each patch and cluster."""
        scene = self.lightmap.scene
        albedo = self.patches.albedo(scene.materials, scene.material_ids, self.lightmap.charts.face_triangle)
        return np.minimum(albedo, MOST_ALBEDO)

    def set_observer(self, position: F64) -> None:
        """The eye is at ``position`` (3,) [m]: from the next piece of work on, what is near it is lit. Raises UserError for no
        place at all."""
        if not np.isfinite(position).all():
            raise UserError(f"the observer is at {', '.join(f'{x:g}' for x in position)}: no place in the world")
        observer = self.lightmap.space.local_from_world(np.asarray(position, np.float64))
        if not np.array_equal(observer, self._tiles.observer):
            self._tiles.observer = observer
            self._look()

    def _look(self) -> None:
        """Which nodes are wanted in the set from here."""
        self.exchange.look(self._tiles.observer, self.options.outside)

    # -- kept for later ------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """Nothing to be kept: what is around the observer is lit anew in seconds, wherever it is by then."""
        return State()

    def restore(self, state: State) -> None:
        """Begin anew, whatever was kept."""
        self.lightmap.clear()

    # -- what there is to see ------------------------------------------------------------------------------------------

    @property
    def resolved(self) -> Mapping[str, Any]:
        return {"patches": self.set.most, "patch_level": self.level}

    @property
    def layers(self) -> Mapping[str, Texture]:
        return {"direct": self.direct.light, "local": self.lighting.marks(self.members.pieces)}

    @property
    def wanted(self) -> I64:
        """The nodes that the set is to have, nearest first."""
        return self.exchange.wanted

    @property
    def to_come(self) -> int:
        """How many of these are not in the set yet."""
        return self.exchange.to_come

    def inspect(self, texel: tuple[int, int] | None = None, *, images: bool = False) -> Inspection:
        """What the set, its rows and its matrix are; of a texel, the node that it is in."""
        held, lightmap = self.set, self.lightmap
        figures = figures_of(
            held, self.patches, self.rows, self.matrix, self.lighting, self._tiles.observer, lightmap.space.scale
        ) | {"Matrix off by": f"{100 * self._error:.2g} %"}
        counts = {"Rays traced": self.rows.traced + self.direct.traced}
        if texel is None or any(at >= size for at, size in zip(texel, lightmap.size, strict=True)):
            return Inspection(figures=figures, counts=counts)
        place = np.flatnonzero(self.patches.order == (texel[1] << 16 | texel[0]))
        slot = int(held.slot_at[place[0]]) if len(place) else -1
        age = self.members.pieces - int(self.members.entered[slot])
        facts = facts_of(int(held.node[slot]), slot, self.patches, age, float(held.outside[slot]))
        return Inspection(figures=figures, counts=counts, texel_facts=facts)

    def passes(self, amount: int) -> dict[str, Callable[[], None]]:
        """Each part of a piece of work by itself, to be timed."""
        self._under_way.finish()
        tiles = self._tiles.in_turn()
        node, needed = int(self.wanted[0]), self.exchange.needed
        run_to_end(self.rows.make(self.wanted[:1][~self.rows.has(self.wanted[:1])], needed))

        def swap() -> None:
            if self.set.slot[node] >= 0:
                self.members.leave(node)
            self.members.enter(node)
            self.matrix.flush()

        return {
            "swap": swap,
            "shadow rays": lambda: run_to_end(self.direct.shoot_from(tiles)),
            "sum": lambda: self.direct.sum(self.lightmap.scene),
            "light": self._light_anew,
            "compose": lambda: self._compose(all_=True),
        }

    def _light_anew(self) -> None:
        self._relighting.changed()
        self._relighting.go_on(self.direct.light)

    def warm_up(self) -> Iterator[None]:
        """Every pass."""
        for run in self.passes(1).values():
            run()
            self.gpu.ctx.finish()
            yield

    def _release_parts(self) -> None:
        for part in self._parts:
            part.release()
        self._parts.clear()

    def release(self) -> None:
        self._under_way.drop()
        self._release_parts()
        for part in (self.direct, self.origins, self.rays):
            part.release()
