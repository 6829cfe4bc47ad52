"""The passes of a shot and what they write: everything on the GPU that ``UniformShooting`` drives."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from app.gpu import Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.quadtree import Change
from app.lightmap.tile_pool import Moves
from app.scene.model import F32, F64
from app.solvers.shooting.options import MAX_LEVEL, VISIBILITIES, ShootingOptions, highest_level
from app.visibility.projections import PROJECTIONS, Occluders

BATCH = 8  # shooters chosen at once: choosing reads every texel, so one choice serves several shots
RUNS = 64  # at least, of squares: a batch is chosen from the strongest patch of each
OPEN = 0.0  # item of the open background, see common/item.glsl
SHOOTER_ROWS = 6  # texels that describe one shooter, see shooter.glsl
BLOCK_BYTES = 256  # no driver asks for a coarser uniform block alignment
BLOCK_ROWS = BLOCK_BYTES // 16  # texels in a row of t_shooters: one shooter, padded to a uniform block
REPORT_HEAD = 2  # texels of the report before those of its first shooter, see report.frag.glsl
EMITTER = 16  # marks a patch, see patch_level.glsl
LEVELS = 8  # of patches: a candidate has its level in units of its row, see candidate.glsl
SQUARE_LEVEL = 3  # a batch takes one patch at most of each square of so many texels, as a power of 2
BLOCK_LEVEL = 2  # blocks of so many texels along each edge, as a power of 2, are summed once, see patches.frag.glsl
LEDGER_ROWS = 3  # see ledger.frag.glsl
# Patches of a scene: about so many show the light first, and unless a level is set, the finest are no more than the most, since
# more gain little, nor finer than a level.
FIRST_PATCHES, MOST_PATCHES, LEVEL = 400, 4096, 2
ROOT_LEVEL = 2  # quadtrees: at this level a texel of the root shoots by itself
# px, of maps that follow from the scene. Below, shadows of few texels get coarse too: 128 for 256 makes 2.2 % error 2.6 % in the
# Cornell box of 32,000 texels. Above, there is little to gain: 512 for 256 takes 181,000 texels of an other scene half as long
# again, for 1 % less error.
RESOLUTIONS = (256, 512)
OPEN_BLOCK = 8  # visibility texels along the edge of a block that open.frag.glsl sums
MAPS_TEXELS = 2**21  # of visibility that are drawn at once: more gain little and cost memory


def fitting_resolution(lightmap: Lightmap, *, adaptive: bool) -> int:
    """Edge of a map's full face [px] in which a texel half the scene's diagonal away fills one sample: a face of N samples is 2
    wide at distance 1, so N = 2 / texel in the solver space; of a quadtree, a texel of the level that shoots by patches."""
    texel = 1.0 / (lightmap.charts.density * lightmap.space.scale) / (1 << ROOT_LEVEL if adaptive else 1)
    return int(np.clip(64 * round(2.0 / texel / 64), *RESOLUTIONS))


def patch_levels(lightmap: Lightmap, options: ShootingOptions, *, adaptive: bool) -> list[int]:
    """Of the patches that shoot, those that begin and the finest, as powers of 2 of texels; in quadtrees, of uniform ones."""
    top = MAX_LEVEL if adaptive else highest_level(lightmap.pool.tile)
    texels = lightmap.pool.surfaces.area.sum() * lightmap.charts.density**2 * (4**ROOT_LEVEL if adaptive else 1)
    last = min(LEVEL if options.level is None else options.level, top)
    while options.level is None and last < top and texels / 4**last > MOST_PATCHES:
        last += 1
    first = last
    while options.coarsen and first < top and texels / 4 ** (first + 1) >= FIRST_PATCHES:
        first += 1
    return [first, last] if first > last else [last]


def _mark(marks: F32, finer: int | NDArray[np.int64]) -> None:
    """Let patches be so much finer at least, see patch_level.glsl; what emits stays marked so."""
    marks[:] = marks // EMITTER * EMITTER + np.maximum(marks % EMITTER, finer)


class ShotBuffers:
    """What a shot writes besides the lightmap and does not depend on the options."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap) -> None:
        self._gpu, self._tile = gpu, lightmap.pool.tile
        self.shooters = gpu.texture((BLOCK_ROWS, BATCH), 4, "f4")
        self.shooter_blocks = gpu.buffer(BATCH * BLOCK_BYTES)  # the same, as uniforms
        self.inspected_block = gpu.buffer(BATCH * BLOCK_BYTES)  # the first is a shooter that is looked at by itself
        self.ledger = gpu.texture((BATCH, LEDGER_ROWS), 4, "f4")
        self.ambient = gpu.texture((1, 1), 4, "f4")
        self.occluders = Occluders(gpu, lightmap)
        self.report = gpu.texture((REPORT_HEAD + SHOOTER_ROWS, 1), 4, "f4")
        self.shooter_target = gpu.target(self.shooters)
        self.ledger_target = gpu.target(self.ledger)
        self.ambient_target = gpu.target(self.ambient)
        self.report_target = gpu.target(self.report)
        self.sound: set[tuple[int, int, int]] = set()  # patches whose shots were audited and pass: column, row, edge
        self._fit(lightmap)
        self.all_alike()

    def _fit(self, lightmap: Lightmap) -> None:
        """Make what is as large as the tile pool."""
        gpu, (width, height) = self._gpu, lightmap.size
        squares = (self._tile >> SQUARE_LEVEL) ** 2
        self.runs = gpu.texture((-(-max(RUNS, lightmap.rows) // squares) * squares, 1), 4, "f4")
        self.unshot = gpu.texture(self.runs.size, 4, "f4")  # of the same runs
        self.books = [gpu.texture((lightmap.columns, lightmap.rows), 4, "f4") for _ in range(3)]
        self.finer = gpu.texture((width >> BLOCK_LEVEL, height >> BLOCK_LEVEL), 1, "f4")
        self.finer_levels = np.zeros(self.finer.size[::-1], np.float32)  # the same, see patch_level.glsl
        self.run_target = gpu.target(self.runs, self.unshot)
        self.books_target = gpu.target(*self.books)

    def resize(self, lightmap: Lightmap, moves: Moves) -> None:
        """For a lightmap that has got another number of slots: all leaves shoot as fine as before, and the ledger stays."""
        held = moves.array(self._tiles.reshape(-1, *self._tiles.shape[2:]), 0)
        self._gpu.release_all(self.run_target, self.books_target, self.runs, self.unshot, *self.books, self.finer)
        self._fit(lightmap)
        place = np.divmod(np.arange(moves.slots), lightmap.columns)
        self._tiles[place] = held
        self.finer.write(self.finer_levels.tobytes())
        self.sound.clear()

    def shoot_finer(self, patches: Iterable[tuple[int, int, int, int]]) -> None:
        """Let what is in these patches shoot from patches at least a level finer: column and row of the lower texel, edge, and
        the finest level of patches there."""
        for x, y, edge, finest in patches:
            columns, rows = (slice(c >> BLOCK_LEVEL, (c + edge - 1 >> BLOCK_LEVEL) + 1) for c in (x, y))
            _mark(self.finer_levels[rows, columns], max(finest + 2 - (edge.bit_length() - 1), 1))
        self.finer.write(self.finer_levels.tobytes())

    def divide(
        self,
        power: F64,
        most: float,
        largest: NDArray[np.int64],
        finest: NDArray[np.int64],
        above: NDArray[np.int64],
    ) -> None:
        """Let no patch hold more than so much power (slots, t, t) of texels; largest, finest (slots,): levels of patches. Where
        texels of uniform size, finer by ``above`` levels (slots,), hold more by themselves, each is its own: one would shoot for
        four beside which nothing else counts."""
        edge, highest = self._tile, highest_level(self._tile)
        level = np.full((len(power), edge, edge), highest)
        for one in range(highest, 0, -1):
            squares = power.reshape(-1, edge >> one, 1 << one, edge >> one, 1 << one).sum((2, 4)) > most
            level[squares.repeat(1 << one, 1).repeat(1 << one, 2)] = one - 1
        blocks = edge >> BLOCK_LEVEL
        in_blocks = -1, blocks, 1 << BLOCK_LEVEL, blocks, 1 << BLOCK_LEVEL
        shares = (power <= most * 4.0 ** above[:, None, None]).reshape(in_blocks).all((2, 4))
        level = level.reshape(in_blocks).min((2, 4))
        largest, finest = largest[:, None, None], finest[:, None, None]
        finer = np.where(level < largest, np.maximum(finest + 1 - level, 1), 0)
        place = np.divmod(np.arange(len(power)), self._tiles.shape[1])
        tiles = self._tiles[place]
        _mark(tiles, finer)
        self._tiles[place] = tiles % EMITTER + EMITTER * ((finer > 0) & shares)
        self.finer.write(self.finer_levels.tobytes())

    def divide_at(self, places: NDArray[np.bool_], finer: int) -> None:
        """Let patches be so much finer in blocks that hold or touch any of these texels (slots, t, t), see patch_level.glsl."""
        places = maximum_filter(places, size=(1, 3, 3))
        blocks = self._tile >> BLOCK_LEVEL
        held = places.reshape(-1, blocks, 1 << BLOCK_LEVEL, blocks, 1 << BLOCK_LEVEL).any((2, 4))
        place = np.divmod(np.arange(len(places)), self._tiles.shape[1])
        tiles = self._tiles[place]
        _mark(tiles, np.where(held, finer, 0).astype(np.int64))
        self._tiles[place] = tiles
        self.finer.write(self.finer_levels.tobytes())

    def hand_down(self, change: Change) -> None:
        """Let leaves that came shoot as fine as what was in their place."""
        self.sound.clear()
        if not self.finer_levels.any():
            return
        tiles, columns = self._tiles, self._tiles.shape[1]
        parents, children = (np.divmod(slots, columns) for slots in (change.parents, change.children))
        blocks = np.arange(tiles.shape[-1])
        across, up = (side * len(blocks) // 2 + blocks // 2 for side in change.corner.T[..., None])
        held, gone = tiles[parents if change.split else children], parents if change.split else children
        tiles[gone] = 0
        place = up[:, :, None], across[:, None, :]
        if change.split:
            tiles[children] = held[np.arange(len(held))[:, None, None], *place]
        else:
            place = tuple(at[:, None, None] for at in parents) + place
            flags, finer = np.zeros_like(tiles), np.zeros_like(tiles)
            np.maximum.at(flags, place, held // EMITTER)
            np.maximum.at(finer, place, held % EMITTER)
            tiles += flags * EMITTER + finer
        self.finer.write(self.finer_levels.tobytes())

    def finer_at(self, texel: tuple[int, int]) -> int:
        """0, or 1 and the levels by which the patch of this texel is finer than the finest of others."""
        return int(self.finer_levels[texel[1] >> BLOCK_LEVEL, texel[0] >> BLOCK_LEVEL]) % EMITTER

    @property
    def _tiles(self) -> F32:
        """A view (rows, columns, blocks, blocks) of those of every slot."""
        edge = self._tile >> BLOCK_LEVEL
        rows, columns = (side // edge for side in self.finer_levels.shape)
        return self.finer_levels.reshape(rows, edge, columns, edge).swapaxes(1, 2)

    def finest_is(self, higher: int) -> None:
        """For a finest level so much higher, or lower: what was divided stays as fine, since patches may be owed light there."""
        marks = self.finer_levels
        marks[:] = np.where(marks > 0, marks // EMITTER * EMITTER + np.maximum(marks % EMITTER + higher, 1), 0)
        self.sound.clear()
        self.finer.write(marks.tobytes())

    def all_alike(self) -> None:
        """Let nothing shoot from finer patches than other things."""
        self.sound.clear()
        self.finer_levels[:] = 0
        self.finer.write(self.finer_levels.tobytes())

    def release(self) -> None:
        release_all(self._gpu, self)


class ChoiceStages:
    """Choosing among patches of one level and smaller ones; in quadtrees, of that level at the root and of finer ones below.
    finest: the level that will shoot in the end; pays: whether only emitters' families shoot, all of one at once."""

    def __init__(
        self, gpu: Gpu, lightmap: Lightmap, level: int, finest: int, *, adaptive: bool, pays: bool = False
    ) -> None:
        self._gpu, self.level, self.pays = gpu, level, pays
        self._fit(lightmap)
        tile = lightmap.pool.tile
        root, top = ROOT_LEVEL if adaptive else 0, {"HIGHEST": highest_level(tile)}
        of_block = {"BLOCK": 1 << BLOCK_LEVEL, "BLOCK_LEVEL": BLOCK_LEVEL}
        of_block["LEVELS"] = LEVELS
        of_tile = {"TILE_SQUARES": tile >> SQUARE_LEVEL}
        reads = lightmap.defines("TILE", "MATERIAL_BITS", "ALBEDO_TEXTURE")
        levels = {"LEVEL": level - root, "FINEST": finest - root, "EMITTER": EMITTER, "PAYS": pays}
        square = {"SQUARE_LEVEL": SQUARE_LEVEL}
        self.add_patches = Pass(gpu, "solvers/shooting/patches", defines=reads | of_block | levels | top)
        self.begin = Pass(gpu, "solvers/shooting/begin", defines=of_block | of_tile | top | square)
        self.add_runs = Pass(gpu, "solvers/shooting/runs", defines=of_tile)
        self.choose = Pass(gpu, "solvers/shooting/choose", defines=reads | of_block | levels | top | square)

    def _fit(self, lightmap: Lightmap) -> None:
        width, height = lightmap.size
        size = width >> BLOCK_LEVEL, height >> BLOCK_LEVEL
        self.patches = [self._gpu.texture(size, components, "f4") for components in (4, 4, 2)]
        self.patch_target = self._gpu.target(*self.patches)
        squares = width >> SQUARE_LEVEL, height >> SQUARE_LEVEL
        self.candidates = [self._gpu.texture(squares, 4, "f4") for _ in range(2)]
        self.candidate_target = self._gpu.target(*self.candidates)

    def resize(self, lightmap: Lightmap) -> None:
        """For a lightmap that has got another number of slots."""
        self._gpu.release_all(self.patch_target, *self.patches, self.candidate_target, *self.candidates)
        self._fit(lightmap)

    def release(self) -> None:
        release_all(self._gpu, self)


class Maps:
    """What some shots see, at once: their maps of visibility above each other, and how much of each is open."""

    def __init__(self, gpu: Gpu, map_size: tuple[int, int], count: int) -> None:
        self._gpu, self.count = gpu, count
        width, height = self.map_size = map_size
        # two textures of four bytes: llvmpipe clears eight bytes ten times slower
        self.items = gpu.texture((width, height * count), 1, "f4")
        self.depth = gpu.depth_texture(self.items.size)
        self.open_size = (width // OPEN_BLOCK, height // OPEN_BLOCK)  # blocks of one shot
        self.open = gpu.texture((self.open_size[0], self.open_size[1] * BATCH), 2, "f4")
        self.target = gpu.target(self.items, depth=self.depth)
        self.open_target = gpu.target(self.open)

    def release(self) -> None:
        release_all(self._gpu, self)


class ShotStages:
    """Programs and maps that follow from the options: built anew when they change."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, options: ShootingOptions, *, adaptive: bool = False) -> None:
        self._gpu, self.projection, self._visibility = gpu, PROJECTIONS[options.projection], options.visibility
        levels = patch_levels(lightmap, options, adaptive=adaptive)
        self.choices = [ChoiceStages(gpu, lightmap, level, levels[-1], adaptive=adaptive) for level in levels]
        if len(levels) > 1:
            self.choices.insert(1, ChoiceStages(gpu, lightmap, *levels, adaptive=adaptive, pays=True))
        self.resolution = options.resolution or fitting_resolution(lightmap, adaptive=adaptive)
        width, height = self.map_size = self.projection.size(self.resolution)
        self.most_maps = max(1, min(BATCH, MAPS_TEXELS // (width * height)))
        self.maps = Maps(gpu, self.map_size, 1)
        self._inspected: Maps | None = None
        self.weights = gpu.texture((width // 4, height // 4), 4, "f4")  # see weights.frag.glsl

        resolution = {"RESOLUTION": self.resolution}
        reads = {"projection": self.projection.glsl}
        self.storage = lightmap.storage
        keeps = {"KEEPS": self.storage != "fixed8"}
        self.zero = Pass(
            gpu, "solvers/shooting/zero", defines=keeps | lightmap.defines("MATERIAL_BITS", "ALBEDO_TEXTURE")
        )
        self.see = Pass(
            gpu,
            "solvers/shooting/visibility",
            defines=resolution | {"VIEWS": self.projection.views},
            slots=self.projection.drawing,
        )
        self.see_small = Pass(gpu, "solvers/shooting/small", defines=resolution, slots=reads)
        self.count_small = Pass(gpu, "solvers/shooting/small", defines=resolution | {"COUNT": 1}, slots=reads)
        self.receive = {
            (flat, near): self._receive(gpu, lightmap, options, flat=flat, near=near)
            for flat in ((True, False) if adaptive else lightmap.receivers)
            for near in (False, True)
        }
        self.add_open = Pass(gpu, "solvers/shooting/open", defines={"BLOCK": OPEN_BLOCK})
        self.audit = Pass(gpu, "solvers/shooting/audit", defines=lightmap.defines("TILE"))
        self.enter = Pass(gpu, "solvers/shooting/ledger")
        self.tell = Pass(gpu, "solvers/shooting/report")
        self.expect = Pass(gpu, "solvers/shooting/ambient")
        weights_target = gpu.target(self.weights)
        Pass(gpu, "solvers/shooting/weights", defines=resolution, slots=reads).draw(weights_target)
        gpu.release_all(weights_target)
        self.add_books = Pass(
            gpu, "solvers/shooting/books", defines=lightmap.defines("TILE", "MATERIAL_BITS", "ALBEDO_TEXTURE")
        )

    @property
    def sight_textures(self) -> dict[str, Texture]:
        """What a receiver looks its visibility up in."""
        items = {"t_items": self.maps.items}
        return items if self._visibility == "item-id" else items | {"t_depth": self.maps.depth}

    @property
    def inspected(self) -> Maps:
        """One map beside those of a step, which may be under way."""
        self._inspected = self._inspected or Maps(self._gpu, self.map_size, 1)
        return self._inspected

    def groups(self, shots: int) -> list[tuple[int, int]]:
        """(first, count) of those shots of a batch that see the scene at once; makes room for their maps."""
        count = min(shots, self.most_maps)
        if count > self.maps.count:
            self.maps.release()
            self.maps = Maps(self._gpu, self.map_size, count)
        return [(first, min(count, shots - first)) for first in range(0, shots, count)]

    def resize(self, lightmap: Lightmap) -> None:
        """For a lightmap that has got another number of slots."""
        for choice in self.choices:
            choice.resize(lightmap)

    def _receive(self, gpu: Gpu, lightmap: Lightmap, options: ShootingOptions, *, flat: bool, near: bool) -> Pass:
        defines: dict[str, object] = {
            "FLAT": flat,
            "NEAR_FIELD": near,
            "RESOLUTION": self.resolution,
            "DISC": options.form_factor == "disc",
            "DISC_SUBDIVISION": options.discs,
            "VISIBILITY": VISIBILITIES.index(options.visibility),
        }
        defines |= lightmap.defines("MATERIAL_BITS", "ALBEDO_TEXTURE")
        label = f"shooting/receive {'flat' if flat else 'shaped'} {'near' if near else 'far'}"
        return Pass(
            gpu, "solvers/shooting/receive", defines=defines, slots={"projection": self.projection.glsl}, label=label
        )

    def release(self) -> None:
        release_all(self._gpu, self)


def release_all(gpu: Gpu, owner: object) -> None:
    """Release every texture, buffer and target that is an attribute of ``owner``, or what those own that can be released."""
    values = [v for value in vars(owner).values() for v in (value if isinstance(value, list) else [value])]
    gpu.release_all(*(v for v in values if hasattr(v, "release") and v is not gpu))
