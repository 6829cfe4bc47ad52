"""The ambient term is the irradiance that unshot light will make, shown and baked with H from the first shots on [Cohen88, 5].

Of what surfaces have yet to shoot it is gathered by points that know what they see, see gather_points.py; of what lamps and
sources outside have yet to give, it goes where such light came from the start. Until there is a tree of the triangles that the
rays of points walk, and all points have looked FIRST_SWEEPS times, what surfaces have yet to shoot is shown as an even term; or
what other texels of the same scene had is shown as all that is to come. Where the storage can hold a residual below zero that of
patches is overshot [Feda92]: a patch shoots, with its residual, what it will reflect of an even ambient term.
"""

from __future__ import annotations

import contextlib

import numpy as np

from app.errors import UserError
from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import write_table
from app.lightmap.tile_pool import TABLE_WIDTH, Moves
from app.solvers.shooting.choose import Bins
from app.solvers.shooting.gather_points import GatherPoints
from app.solvers.shooting.ledger import Ledger
from app.solvers.shooting.point_spread import PointSpread
from app.solvers.shooting.records import BLOCK_LEVEL, RECORDS
from app.solvers.shooting.shooters import ShooterBatch
from app.util.background import BackgroundTask
from app.visibility.bvh import Bvh
from app.visibility.rays import tree_is_near, tree_of

SWEEPS = 6  # looks of each point until nothing changes: as many reflections
# Until what they find takes the place of an even term: in a room of albedo 0.6 that has 79 % of the light that there will be on
# average, and what is found in 1 to 5 sweeps 62, 77, 85, 90 and 93 %: after fewer it would be darker, in a brighter room as well
FIRST_SWEEPS = 4
# Of one frame, where not all must be: points that look around. Fewer passes do more at once: frames wait until there are so many.
POINTS_A_FRAME, POINTS_A_LOOK = 512, 2048
# What a point takes, of the time of a look: to see what its texels have to pass on; to find what its rays hit
SEEING, TRACING = 0.25, 8.0
# Batches at first, after which each texel has its even term whether frames are drawn or not: the first frame, which says that
# they are, comes after one or a few
FIRST_UPDATES = 4
FIRST = 4  # times as many points of a frame until what they find is shown, or is known what their rays hit
TRACED_AT_ONCE = 512  # points, at most: with ten thousands of triangles on a software rasteriser 50 ms
# Share of the light that is passed on until points look again: of that, what they foresaw is shown
PASSED_ON = 1 / 16
TEXEL_BYTES = 16  # of an ambient term of each texel


class Ambient:
    """Whoever makes it releases it.

    even: one texel, the even term of all that is unshot, see even_ambient.frag.glsl. shown: whether the lightmap is given any.
    held: while light is taken from those who shoot and has not arrived: it is looked at after that. strongest: share of the light
    that a shot passes on at most.
    """

    def __init__(
        self, gpu: Gpu, lightmap: Lightmap, shooters: ShooterBatch, ledger: Ledger, *, shown: bool, gathers: bool
    ) -> None:
        """gathers: whether points gather it, once there is a tree that their rays walk; else it stays an even one."""
        self._gathers = gathers
        self._gpu, self._lightmap, self._shooters, self._ledger = gpu, lightmap, shooters, ledger
        self.even, self._lamps, self._to_come, self._direct = (gpu.texture((n, 1), 4, "f4") for n in (1, 1, 3, 3))
        self._nothing = gpu.texture((1, 1), 4, "f4", bytes(16))
        self.even_target = gpu.target(self.even)
        self._lamps_target = gpu.target(self._lamps)
        self._to_come_target, self._direct_target = gpu.target(self._to_come), gpu.target(self._direct)
        self._estimate = Pass(gpu, "solvers/shooting/even_ambient", slots=RECORDS)
        self._add_lamps = Pass(
            gpu,
            "solvers/shooting/unshot_lamps",
            defines=lightmap.defines("MATERIAL_BITS") | {"BLOCK_LEVEL": BLOCK_LEVEL},
        )
        self._find_to_come = Pass(gpu, "solvers/shooting/to_come", slots=RECORDS)
        self._lamp_blocks = gpu.texture((1, 1), 1, "u4")
        self._lamp_count = 0
        self._points: GatherPoints | None = None
        self._looked = 0  # sweeps since light began; what they find is hidden for as long as they are few
        self._hidden: tuple[Texture, Framebuffer] | None = None
        self._foreseen = self._watched = False  # whether others told what is to come; whether frames are drawn
        self._updates = 0  # since light began
        self._spread_even = Pass(gpu, "solvers/shooting/spread_even")
        self._tree: BackgroundTask[Bvh] | None = None
        self.shown, self.held = shown, False
        self.note: str | None = None
        self._sweeps, self._next_row = SWEEPS, 0
        self._passed_on = 1.0  # share of the light, at most, since points began to look
        self._owed = 0.0  # points that frames asked to look
        self.strongest = 1.0
        lightmap.ambient_of, lightmap.foresee = self.refresh, self.foresee

    @property
    def overshoot(self) -> Texture:
        """One texel, the irradiance of which patches overshoot."""
        return self._nothing if self._lightmap.storage == "fixed8" else self.even

    def update(self, bins: Bins, shots: int | None = None) -> None:
        """Estimate the even term from what is unshot in the bins, and from so many shots of a batch since; None: anything may be
        other than it was. Points look that frames asked for while light was held."""
        self.changed(1.0 if shots is None else shots * self.strongest)
        ledger = self._ledger
        self._estimate.draw(
            self.even_target,
            textures={"t_unshot": bins.unshot, "t_ledger": ledger.texture, "t_shooters": self._shooters.texture},
            uniforms={"u_shots": shots or 0, "u_albedo": ledger.albedo, "u_area": ledger.area},
        )
        self._updates += 1
        self._show_even()
        if self._owed and self._points is not None:
            self._look_for_frames(self._points)

    def _show_even(self) -> None:
        """Show the even term, unless more is known: of each texel where frames may be drawn while light arrives in some of them
        and not yet in others; not where memory does not do."""
        if not self.shown or self._looked >= FIRST_SWEEPS or self._foreseen:
            return
        lightmap = self._lightmap
        of_each = self._watched or self._updates <= FIRST_UPDATES
        with contextlib.suppress(UserError):
            lightmap.hold_ambient(of_each=of_each)
        if not lightmap.ambient_of_each:
            self._find_what_is_to_come(lightmap.ambient_target)
            return
        self._find_what_is_to_come(self._to_come_target)
        bound = {"t_to_come": self._to_come} | lightmap.textures("t_irradiance")
        self._spread_even.draw(lightmap.ambient_target, textures=bound)

    def changed(self, share: float = 1.0) -> None:
        """Other light is unshot than when the lightmap was given its ambient term. share: of all light, that was passed on."""
        self._sweeps = SWEEPS
        self._passed_on = min(self._passed_on + share, 1.0)

    def refresh(self, whole: bool, wait: bool) -> None:
        """Give the lightmap the ambient term of the light as it is; if not ``whole``, POINTS_A_FRAME towards it. wait: for the
        tree that rays walk, without which it is an even one."""
        self._watched |= not whole
        if not self.shown or not self._gathers or self.note is not None or not self._sweeps:
            return
        try:
            points = self._points_now(wait)
        except UserError as error:
            self._do_without(error)
            return
        if points is None:
            return
        if whole:
            self._look(points, float("inf"))
            self._passed_on = 0.0
            return
        self._owed = min(self._owed + POINTS_A_FRAME, FIRST * POINTS_A_LOOK)
        if not self.held:
            self._look_for_frames(points)

    def foresee(self, irradiance: Texture) -> None:
        """Show that of each block [stored units], a: above 0 where it is known, as what is to come until all points have looked.
        Not where memory does not do. Nothing may have been shot."""
        lightmap = self._lightmap
        if not self.shown or self.note is not None:
            return
        with contextlib.suppress(UserError), contextlib.ExitStack() as undo:
            spread = PointSpread(self._gpu, lightmap)
            undo.callback(spread.release)
            lightmap.hold_ambient()
            self._foreseen = True
            self._to_come_target.clear()
            spread.find_around(0, spread.rows)
            spread.draw(lightmap.ambient_target, irradiance, self._to_come, 0, spread.rows, foreseen=True)

    def _look_for_frames(self, points: GatherPoints) -> None:
        """As many looks as frames asked for, once they are enough, and where as much was passed on that it is seen."""
        first = self._looked < FIRST_SWEEPS or not points.knows(self._next_row % points.rows)
        if self._next_row == 0 and self._passed_on < PASSED_ON:
            self._owed = 0.0
        elif first or self._owed >= min(POINTS_A_LOOK, points.rows * points.columns):
            self._look(points, min(FIRST * self._owed, TRACED_AT_ONCE * TRACING) if first else self._owed)
            self._owed = 0.0

    def _look(self, points: GatherPoints, budget: float) -> None:
        """Looks that take as long as so many, in turn: in the first half of a sweep it is seen what texels have to pass on, in
        the other points look at that. At first what they find is hidden, since parts of it beside what was shown before would
        be seen."""
        if self._looked < FIRST_SWEEPS and self._hidden is None:
            try:
                self._hidden = self._lightmap.make_ambient()
            except UserError as error:
                self._do_without(error)
                return
        self._find_what_is_to_come(self._to_come_target)
        if self._looked == 0:
            self._find_what_is_to_come(self._direct_target, even=False)
        while self._sweeps and budget > 0:
            half, row = divmod(self._next_row, points.rows)
            cost = SEEING if half == 0 else 1.0 if points.knows(row) else TRACING
            some = int(max(min(budget / (cost * points.columns), points.rows - row), 1))
            ambient, target = self._hidden or (self._lightmap.texture("t_ambient"), self._lightmap.ambient_target)
            if half == 0:
                points.see_light(ambient if self._looked else self._direct, row, some)
            else:
                points.look(self.even, row, some)
                points.spread(target, self._to_come, row, some)
            budget -= cost * some * points.columns
            self._next_row = (self._next_row + some) % (2 * points.rows)
            if self._next_row == 0:
                self._sweeps -= 1
                self._looked += 1
                if self._hidden is not None and self._looked >= FIRST_SWEEPS:
                    self._lightmap.take_ambient(*self._hidden)
                    self._lightmap.ambients += 1
                    self._hidden = None
                self._passed_on *= float(np.mean(self._ledger.albedo))  # of it, what is reflected once more

    def _points_now(self, wait: bool) -> GatherPoints | None:
        """The points; unless ``wait``, none while their tree is built in the background. Raises UserError where there can be
        none."""
        pool = self._lightmap.pool
        if self._points is None and (wait or tree_is_near(pool)):
            self._points = GatherPoints(self._gpu, self._lightmap)
        elif self._points is None and self._tree is None:
            self._tree = BackgroundTask("rays in this scene", lambda tell: tree_of(pool, lambda share: tell("", share)))
        elif self._points is None and self._tree is not None and self._tree.ended:
            _ = self._tree.result  # raises why there is none
        return self._points

    def _do_without(self, error: UserError) -> None:
        """Show the even term from now on: there cannot be points."""
        self.note = f"the ambient term stays an even one: {error}"
        if self._points is not None:
            self._points.release()
            self._points = None
        self._drop_hidden()
        self._foreseen = False
        self._show_even()

    def _show_none(self) -> None:
        """Until it is known what to show."""
        self._drop_hidden()
        self._foreseen, self._updates = False, 0
        self._lightmap.hold_ambient(of_each=False)
        self._lightmap.ambient_target.clear()

    def _drop_hidden(self) -> None:
        """Points begin to look anew."""
        self._looked = self._next_row = 0
        self._gpu.release_all(*(self._hidden or ()))
        self._hidden = None

    @property
    def memory(self) -> int:
        """Bytes on the GPU of what gathers it, besides the lightmap's own."""
        hidden = 0 if self._hidden is None else self._hidden[0].width * self._hidden[0].height * TEXEL_BYTES
        return hidden + (0 if self._points is None else self._points.memory)

    def _find_what_is_to_come(self, target: Framebuffer, *, even: bool = True) -> None:
        """See what lamps and sources outside have yet to give, and the even term of the rest, or nothing of that."""
        ledger, lightmap = self._ledger, self._lightmap
        self._lamps_target.clear()
        if self._lamp_count:
            reads = "t_position_area", "t_normal_ids", "t_materials", "t_residual"
            self._add_lamps.draw(
                self._lamps_target,
                textures=lightmap.textures(*reads) | {"t_lamp_blocks": self._lamp_blocks},
                vertices=self._lamp_count,
                points=True,
                blend="add",
            )
        self._find_to_come.draw(
            target,
            textures={"t_lamps": self._lamps, "t_ledger": ledger.texture, "t_even": self.even},
            uniforms={
                "u_area": ledger.area,
                "u_albedo": ledger.albedo,
                "u_rest": float(even),
                "u_usual": self._usual,
                "u_ahead": ledger.ahead,
                "u_outside": tuple((ledger.foreseen / ledger.watt).tolist()),
            },
        )

    @property
    def _usual(self) -> tuple[float, ...]:
        """Of an even term, the most that is shown: what the forecast of the scene as it was opened has [stored units]."""
        lightmap = self._lightmap
        usual = lightmap.pool.usual_light if lightmap.scene is lightmap.pool.scene else None
        return (1e30,) * 3 if usual is None else tuple((usual / lightmap.unit).tolist())

    def find_lamps(self) -> None:
        """See which texels emit now."""
        pool, shines = self._lightmap.pool, self._lightmap.emits
        across = pool.tile >> BLOCK_LEVEL
        blocks = shines.reshape(-1, across, 1 << BLOCK_LEVEL, across, 1 << BLOCK_LEVEL).any(axis=(2, 4))
        tile, row, column = np.nonzero(blocks)
        x = tile % pool.columns * across + column
        y = tile // pool.columns * across + row
        self._lamp_count = len(x)
        table = np.zeros((-(-max(len(x), 1) // TABLE_WIDTH), TABLE_WIDTH, 1), np.uint32)
        table.reshape(-1)[: len(x)] = y << 16 | x
        self._lamp_blocks = write_table(self._gpu, self._lamp_blocks, table)

    def leaves_changed(self) -> None:
        """Leaves have split, or merged."""
        self.find_lamps()
        self.changed()
        if self._points is not None:
            self._points.leaves_changed()

    def resize(self, moves: Moves) -> None:
        """For a lightmap that has got another number of slots."""
        self.find_lamps()
        if self._points is not None:
            self._next_row = 0
            if self._hidden is not None:
                hidden, target = self._hidden
                self._gpu.release_all(target)
                hidden = self._lightmap.moved(hidden, moves)
                self._hidden = hidden, self._gpu.target(hidden)
            try:
                self._points.resize()
            except UserError as error:
                self._do_without(error)

    def show(self, shown: bool) -> None:
        """Show it from now on, or none."""
        self.shown, self.note = shown, None
        self.changed()
        if not shown:
            self._show_none()

    @property
    def carried(self) -> list[tuple[Texture, Framebuffer]]:
        """What goes with leaves that split or merge, see LeafFollower."""
        lightmap = self._lightmap
        shown = [(lightmap.texture("t_ambient"), lightmap.ambient_target)] if lightmap.ambient_of_each else []
        return shown if self._hidden is None else [*shown, self._hidden]

    def forget_foreseen(self) -> None:
        """Lamps and surfaces are others than in those texels where the light was that is foreseen."""
        if self._foreseen and self._looked < FIRST_SWEEPS:
            self._show_none()

    def clear(self) -> None:
        """Nothing has been shot."""
        self.held = False
        self.changed()
        self.even_target.clear()
        self._show_none()

    def release(self) -> None:
        if self._lightmap.ambient_of == self.refresh:  # not yet of another solver
            self._lightmap.ambient_of = self._lightmap.foresee = None
        if self._tree is not None:
            self._tree.cancel()
        if self._points is not None:
            self._points.release()
        self._drop_hidden()
        self._gpu.release_all(self.even_target, self.even, self._nothing, self._lamps_target, self._lamps)
        self._gpu.release_all(self._to_come_target, self._to_come, self._direct_target, self._direct, self._lamp_blocks)
