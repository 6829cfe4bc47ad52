"""Earlier shots made again, into leaves that came later.

A leaf that has just split off inherits interpolated light. The shots whose light is in it are made again, into such leaves only,
a batch per step, and their sum takes the place of what was inherited:

    C = Σ_i r_i F_ji V_ji - H_j,   H_j += C,   r_j += ρ_j C

so that the solution does not depend on when the tree grew. New shots meanwhile reach fresh leaves as any other.

Strong shots cast the shadows that leaves are split for. Once they are over, H as they left it, S, is kept: from then on only they
are made again (with S for H above, and S_j += C), and interpolated light of the weak ones, which is smooth, stays. Where the user
asked for other leaves, the weak ones follow: with H - S for H.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.gpu import Framebuffer, Gpu, Mesh, Pass, Texture
from app.lightmap.lightmap import QUAD_FORMAT, Lightmap, quads, receiver_meshes
from app.lightmap.tile_pool import Moves
from app.scene.model import F64, Material
from app.solvers.shooting.log import ShotLog
from app.solvers.shooting.options import ShootingOptions
from app.solvers.shooting.shot import powers_of, rows_of
from app.solvers.shooting.stages import REPORT_HEAD, ChoiceStages
from app.solvers.shooting.uniform import UniformShooting

# Once the strongest shot left holds less of the emitted power, light is so even that interpolation serves: the Cornell box errs
# by 1.7 % where 100 of 2200 shots count as strong, as where all do, and by 2.5 % where the first 60 do.
# Where a lamp is cut into many patches, direct light is made of faint shots: half of all light is to be shot as well.
STRONG, MOSTLY_SHOT = 2.0**-10, 0.5
REDO_AFTER = 3  # new shots for each that was made again the last time, until some are made again once more


class Reshooting(UniformShooting):
    """Knows which leaves are fresh; whoever changes the leaves says so."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, options: ShootingOptions) -> None:
        self.gpu, self.lightmap = gpu, lightmap
        self._log = ShotLog(gpu)
        self._inherit = Pass(gpu, "solvers/shooting/inherit", vertex="common/rects")
        self._correct = Pass(
            gpu,
            "solvers/shooting/correct",
            defines=lightmap.defines("MATERIAL_BITS", "ALBEDO_TEXTURE"),
            vertex="common/rects",
        )
        self._copy = Pass(gpu, "common/copy")
        if self.adaptive:
            self._correction, self._correction_target = self._texels()
        self._strong: tuple[Texture, Framebuffer] | None = None  # S
        self._strong_shots = 0  # in the log, whose light S is
        self._weak = False  # whether only weak shots are left
        self._fresh: set[int] = set()  # slots whose light is partly inherited
        self._redo_under_way: _Redo | None = None
        self._redone_at = self._redone = 0  # shots in the log when some were last made again; how many were
        self._all_again = False  # also the weak ones
        super().__init__(gpu, lightmap, options)

    # -- the solver's interface ----------------------------------------------------------------------------------------

    def reset(self) -> None:
        """Forget all light."""
        self._log.clear()
        self._end_redo()
        self._forget_strong()
        self._fresh.clear()
        self._redone_at = self._redone = 0
        self._all_again = False
        super().reset()
        self._weak = False

    def set_options(self, options: ShootingOptions) -> None:
        """As of any solver; a redo begins again, all with the same options."""
        self.finish()
        self._end_redo()
        super().set_options(options)

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        """As of any solver; shots of the difference may be strong again."""
        self.finish()
        self._end_redo()
        self._forget_strong()
        super().set_materials(materials)
        self._weak = False

    def release(self) -> None:
        self._end_redo()
        self._forget_strong()
        self._log.release()
        if self.adaptive:
            self.gpu.release_all(self._correction_target, self._correction)
        super().release()

    def _scale_light(self, factor: F64) -> None:
        super()._scale_light(factor)
        self._log.scale(factor)

    def _choose(self, shots: int, bands: int) -> Iterator[None]:
        """The batch; once only weak ones are left, H is kept as S."""
        yield from super()._choose(shots, bands)
        if self.adaptive and self._weak and self._strong is None and self.lightmap.storage != "fixed8":
            self._strong, self._strong_shots = self._texels(), self._log.count
            H = self.lightmap.texture("t_irradiance")
            self._copy.draw(self._strong[1], textures={"t_source": H}, uniforms={"u_offset_px": (0, 0)})

    def _hear(self, choice: ChoiceStages, report: F64) -> None:
        super()._hear(choice, report)
        if choice is not self._choice:  # of patches whose lamps have yet to shoot from finer ones
            return
        power = float(powers_of(report[None, REPORT_HEAD:])[0]) * self._watt
        self._weak = self._weak or (power < STRONG * self._emitted.sum() and self.report.residual < MOSTLY_SHOT)

    def _next_phase(self) -> None:
        """Lamps shoot once more then, from all their patches: strong shots again."""
        super()._next_phase()
        self._forget_strong()
        self._weak = False

    def _book(self, shots: int) -> None:
        super()._book(shots)
        if self.adaptive:
            self._log.add(self.buffers, shots)

    # -- leaves that come and go ---------------------------------------------------------------------------------------

    @property
    def _carried(self) -> list[tuple[Texture, Framebuffer]]:
        """Light besides the lightmap's that goes with its leaves."""
        return [] if self._strong is None else [self._strong]

    def _exchange(self, gone: NDArray[np.int64], came: NDArray[np.int64], *, inherit: bool) -> None:
        """Leaves in these slots took the place of others; ``inherit``: what they hold is interpolated."""
        inherit = inherit or not self._fresh.isdisjoint(gone.tolist())
        self._fresh.difference_update(gone.tolist())
        if inherit and self.lightmap.storage != "fixed8":
            self._fresh.update(came.tolist())  # fixed8 holds no negative correction: leaves keep what they inherit

    def _resized(self, moves: Moves) -> None:
        """The lightmap has got another number of slots."""
        assert self._redo_under_way is None, "it knows its leaves by slot"
        self.gpu.release_all(self._correction_target, self._correction)
        self._correction, self._correction_target = self._texels()
        if self._strong is not None:
            texture, target = self._strong
            self.gpu.release_all(target)
            texture = self.lightmap.moved(texture, moves)
            self._strong = texture, self.gpu.target(texture)
        now = dict(zip(moves.old.tolist(), moves.new.tolist(), strict=True))
        self._fresh = {now.get(slot, slot) for slot in self._fresh}

    def _texels(self, *, per_slot: bool = False) -> tuple[Texture, Framebuffer]:
        """As large as the tile pool, or one for each of its slots."""
        size = (self.lightmap.columns, self.lightmap.rows) if per_slot else self.lightmap.size
        texture = self.gpu.texture(size, 4, "f4")
        return texture, self.gpu.target(texture)

    def _forget_strong(self) -> None:
        for texture, target in self._carried:
            self.gpu.release_all(target, texture)
        self._strong = None

    # -- shots made again ----------------------------------------------------------------------------------------------

    @property
    def _redo_pays(self) -> bool:
        """Whether so many shots were made since the last time that it costs little beside them."""
        return self._log.count >= self._redone_at + REDO_AFTER * self._redone

    def _begin_redo(self) -> None:
        """Into all fresh leaves."""
        slots = np.array(sorted(self._fresh), np.int64)
        end = self._log.count if self._strong is None else self._strong_shots
        self._redo_under_way = _Redo(self.gpu, self.lightmap, slots, end)
        self._take_back(self._redo_under_way)

    def _redo(self, bands: int) -> Generator[None, None, int]:
        """One batch of the log once more, for fresh leaves only, in parts; after the last, its sum takes its place. How many
        shots."""
        redo = self._redo_under_way
        assert redo is not None
        if redo.next < redo.end:
            shots = min(self._log.recall(self.buffers, redo.next), redo.end - redo.next)
            for first, some in self.stages.groups(shots):
                self._see(first, some)
                yield
                for band in range(bands):
                    self._receive(
                        self._correction_target,
                        first,
                        some,
                        blend="add",
                        meshes=redo.receivers,
                        rows=rows_of(self.lightmap.size, band, bands),
                        own=False,
                    )
                    yield
            redo.next += shots
            return shots
        self._put_right(redo)
        if self._all_again and self._strong is not None and not redo.weak:
            redo.weak, redo.end = True, self._log.count
            self._take_back(redo)
            return 0
        self._fresh.difference_update(redo.slots.tolist())
        self._redone_at, self._redone = self._log.count, redo.end
        self._end_redo()
        self.poll(wait=True)  # or an older report would follow
        self.report, self._even = replace(self.report, residual=self.unshot_share()), False
        return 0

    def _take_back(self, redo: _Redo) -> None:
        """C = minus what these leaves hold of the shots that follow."""
        H = self.lightmap.texture("t_irradiance")
        S = H if self._strong is None else self._strong[0]
        self._inherit.draw(
            self._correction_target,
            textures={"t_light": H if redo.weak else S, "t_other": S},
            uniforms={"u_size": self.lightmap.size, "u_other": float(redo.weak)},
            mesh=redo.quads,
        )

    def _put_right(self, redo: _Redo) -> None:
        """H += C, r += ρ C; S += C, of strong shots."""
        strong = [] if redo.weak else [target for _, target in self._carried]
        for target in (self.lightmap.light_target, *strong):
            self._correct.draw(
                target,
                textures=self.lightmap.textures("t_normal_ids", "t_materials", "t_albedo")
                | {"t_correction": self._correction},
                uniforms={"u_size": self.lightmap.size},
                mesh=redo.quads,
                blend="add",
            )

    def _redo_one(self) -> None:
        """The shot that was chosen last once more, into all leaves."""
        redo = _Redo(self.gpu, self.lightmap, np.flatnonzero(self.lightmap.pool.used), 1)
        self._take_back(redo)
        self._receive(self._correction_target, 0, 1, blend="add", meshes=redo.receivers)
        self._put_right(redo)
        redo.release()

    def _end_redo(self) -> None:
        if self._redo_under_way is not None:
            self._redo_under_way.release()
            self._redo_under_way = None


class _Redo:
    """Fresh leaves on their way: their slots, quads and receivers, and which shots are still to be made into them: strong ones,
    or all where S is not kept yet, and then weak ones."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, slots: NDArray[np.int64], shots: int) -> None:
        self._gpu, self.slots, self.next, self.end, self.weak = gpu, slots, 0, shots, False
        pool = lightmap.pool
        place = pool.corners(slots)
        self.quads = Mesh(gpu, quads(place, pool.tile, place).tobytes(), QUAD_FORMAT, per_instance=True)
        flat, shaped = pool.receivers_of(slots)
        self.receivers = receiver_meshes(gpu, flat, shaped)

    def release(self) -> None:
        self._gpu.release_all(self.quads, *self.receivers.values())
