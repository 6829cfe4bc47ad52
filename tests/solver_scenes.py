"""Scenes of quads for the tests of the solver, and their solutions as plain arrays of the texels that cover a surface."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from app.atlas.charts import DEFAULT_TILE
from app.atlas.cuts import cut_at_contacts
from app.atlas.parametrize import parametrize
from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.lightmap.options import LightmapOptions
from app.lightmap.quadtree import quadtree_pool
from app.lightmap.tile_pool import TilePool
from app.options import specs
from app.scene.model import F32, F64, Material, Scene
from app.solvers import DEFAULT_SOLVER, SOLVERS, EnergyBalance, GatheringOptions, ShootingOptions
from app.solvers.gathering.solver import BATCH as GATHERED
from app.solvers.gathering.solver import Gathering
from app.solvers.local.options import LocalOptions
from app.solvers.local.solver import Local
from app.solvers.shooting.audit import Audit
from app.solvers.shooting.choose import ROOT_LEVEL
from app.solvers.shooting.coarse_to_fine import LEVEL
from app.solvers.shooting.inspectable import InspectableShooting
from app.solvers.shooting.options import MAX_LEVEL
from app.solvers.shooting.records import BATCH
from app.solvers.shooting.solver import Shooting
from app.util.parts import run_to_end
from app.visibility.projections import PROJECTIONS

UNIT_SQUARE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])  # faces +z
RAYS = 32  # of a texel, where light is gathered and not said otherwise
NOISE = 0.02  # over the mean, at which gathering is done
ENOUGH = 20_000  # shots: a solve that needs more does not converge


def quads_scene(quads: ArrayLike, materials: Sequence[Material], ids: Sequence[int] | None = None) -> Scene:
    """Rectangles (n, 4, 3) of two triangles each, every one an object; ids (n,) of their materials."""
    corners = np.asarray(quads, np.float64)
    count = len(corners)
    return Scene(
        name="quads",
        positions=corners.reshape(-1, 3),
        triangles=(4 * np.arange(count)[:, None, None] + [[0, 1, 2], [0, 2, 3]]).reshape(-1, 3).astype(np.int32),
        material_ids=np.repeat(np.zeros(count) if ids is None else ids, 2).astype(np.int32),
        object_ids=np.repeat(np.arange(count), 2).astype(np.int32),
        objects=tuple(f"quad {k}" for k in range(count)),
        materials=tuple(materials),
    )


def with_uv(scene: Scene) -> Scene:
    """Quads with texture coordinates that fill each of them."""
    uv = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)[[(0, 1, 2), (0, 2, 3)]]
    return replace(scene, uv0=np.tile(uv, (len(scene.objects), 1, 1)))


def grey(albedo: float, exitance: float = 0.0, *, double_sided: bool = False) -> Material:
    """A grey material; exitance E [W/m²], not radiance."""
    return Material("grey", (albedo,) * 3, (exitance / np.pi,) * 3, double_sided=double_sided)


def room(size: ArrayLike = (1.0, 1.0, 1.0)) -> F64:
    """The six walls (6, 4, 3) of a closed room, fronts inward: floor, ceiling (y), then x, then z."""
    quads = []
    for axis in (1, 0, 2):
        for side in (0.0, 1.0):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            corners = np.zeros((4, 3))
            corners[:, axis] = side
            corners[:, u], corners[:, v] = (0, 1, 1, 0), (0, 0, 1, 1)
            quads.append(corners if side == 0.0 else corners[::-1])
    return np.array(quads) * np.asarray(size, np.float64)


def table_room() -> Scene:
    """A closed room 4 × 3 × 4 with a lamp under the ceiling and a table, both with two sides: direct light, shadow and colour
    bleeding. Every edge is a multiple of 1/2, so that at 8 texels/m it is whole patches."""
    lamp = [[1.5, 2.5, 1.5], [2.5, 2.5, 1.5], [2.5, 2.5, 2.5], [1.5, 2.5, 2.5]]
    table = [[0.5, 1.0, 0.5], [0.5, 1.0, 2.5], [2.0, 1.0, 2.5], [2.0, 1.0, 0.5]]
    materials = (
        grey(0.6),
        Material("red", (0.7, 0.2, 0.1)),
        grey(0.2, 20.0, double_sided=True),
        grey(0.5, double_sided=True),
    )
    return quads_scene([*room((4.0, 3.0, 4.0)), lamp, table], materials, [0, 0, 1, 0, 0, 0, 2, 3])


WAYS = [
    pytest.param(adaptive, projection, id=f"{'adaptive' if adaptive else 'uniform'}-{projection}")
    for adaptive, projection in itertools.product((False, True), PROJECTIONS)
]
EVERY_WAY = pytest.mark.parametrize(("adaptive", "projection"), WAYS)
# maps are drawn of the scene, whatever its texels: of whole solves, quadtrees by one projection are enough
EACH_WAY = pytest.mark.parametrize(("adaptive", "projection"), WAYS[: len(PROJECTIONS) + 1])
FAST = tuple(name for name, family in SOLVERS.items() if not family.quadratic and family.everywhere)
EVERY_SOLVER = pytest.mark.parametrize("solver", FAST)
EVERY_LIGHTMAP = pytest.mark.parametrize("adaptive", [False, True], ids=["uniform", "adaptive"])


@dataclass
class Solution:
    """A lightmap with its solver. position (n, 3) [m], normal (n, 3), area (n,) [m²] and object (n,) of the texels that cover a
    surface, and ``H`` and ``r`` (n, 3) [W/m²], read from the GPU anew: of the leaves that there are now."""

    lightmap: Lightmap
    solver: InspectableShooting

    @property
    def rays(self) -> Gathering:
        """The solver, where it gathers."""
        assert isinstance(self.solver, Gathering)
        return self.solver

    @property
    def variance(self) -> F64:
        """(n,) of H, of the mean of RGB [(W/m²)²], as gathering says."""
        texture, (width, height) = self.rays.layers["variance"], self.lightmap.size
        image = np.frombuffer(texture.read(), np.float32).reshape(height, width, 1)
        return self.lightmap.pool.tiles_from_image(image)[self._covered][..., 0] * self.lightmap.unit**2

    @property
    def _covered(self) -> NDArray[np.bool_]:
        return self.lightmap.pool.surfaces.area > 0

    @property
    def position(self) -> F64:
        return self.lightmap.pool.surfaces.position[self._covered]

    @property
    def normal(self) -> F32:
        return self.lightmap.pool.surfaces.normal[self._covered]

    @property
    def area(self) -> F64:
        return self.lightmap.pool.surfaces.area[self._covered]

    @property
    def object(self) -> NDArray[np.int32]:
        triangle = self.lightmap.charts.face_triangle[self.lightmap.pool.surfaces.face[self._covered]]
        return self.lightmap.scene.object_ids[triangle]

    @property
    def H(self) -> F64:
        return self.lightmap.irradiance()[self._covered].astype(np.float64)

    @property
    def r(self) -> F64:
        return self.lightmap.residual()[self._covered].astype(np.float64)

    @property
    def B(self) -> F64:
        return self.lightmap.radiosity()[self._covered].astype(np.float64)

    @property
    def albedo(self) -> F64:
        return self.lightmap.albedo()[self._covered].astype(np.float64)

    @property
    def book(self) -> EnergyBalance:
        return self.solver.energy()

    def means(self, values: F64) -> F64:
        """(objects, 3) area-weighted means, the two sides of an object together."""
        weights = np.bincount(self.object, self.area)
        return np.stack([np.bincount(self.object, self.area * v) / weights for v in values.T], -1)

    def step(self, shots: int) -> None:
        """Up to so many shots at once."""
        run_to_end(self.solver.work(shots))

    def refine(self, **options: object) -> None:
        """Let leaves follow other options of LightmapOptions."""
        assert self.lightmap.refinement is not None
        self.lightmap.refinement.set_options(self.lightmap.options.replace(**options))

    def shoot(self, shots: int = ENOUGH) -> None:
        """Up to so many shots more, or until converged."""
        last = self.solver.issued + shots
        while self.solver.issued < last and self.solver.poll().remaining > self.solver.options.residual:
            self.step(min(BATCH, last - self.solver.issued))
        self.solver.poll(wait=True)
        assert self.solver.issued < ENOUGH, "did not converge"

    def settle(self, steps: int = ENOUGH) -> None:
        """Until converged and, on quadtrees, until the tree has stopped growing and holds all shots."""
        for _ in range(steps):
            if self.solver.poll().converged:
                break
            self.step(BATCH)
        else:
            raise AssertionError("did not settle")
        self.solver.poll(wait=True)

    def gather(self, rays: int) -> None:
        """Until so many rays of each texel have been traced, and leaves have followed."""
        while self.rays.issued < rays or self.rays.poll(wait=True).refining:
            self.step(max(min(GATHERED, rays - self.rays.issued), 1))
        self.rays.settle()

    def light_up(self) -> None:
        """Give every texel the same residual, so that any patch can shoot."""
        width, height = self.lightmap.size
        self.lightmap.texture("t_residual").write(np.ones((height, width, 4), np.float32).tobytes())

    def patches(self) -> NDArray[np.int64]:
        """(p, 2) column and row of the lower texel of every patch of the shooting level that covers a surface; of what is divided
        there, of the first part, if that does."""
        pool, found = self.lightmap.pool, []
        for slot in range(pool.tiles):
            edge = self.solver.patch_edge(pool.corner(slot))
            inside = pool.surfaces.area[slot].reshape(pool.tile // edge, edge, pool.tile // edge, edge).sum((1, 3)) > 0
            for x, y in (np.argwhere(inside)[:, ::-1] * edge).tolist():
                corner = pool.corner(slot)[0] + x, pool.corner(slot)[1] + y
                own = self.solver.patch_edge(corner)
                if (pool.surfaces.area[slot, y : y + own, x : x + own] > 0).any():
                    found.append(corner)
        return np.array(found, np.int64)

    def audits(self) -> list[Audit]:
        """What becomes of a shot from each patch. Spoils the residual."""
        self.light_up()
        return [self.solver.audit((int(x), int(y))) for x, y in self.patches()]

    def release(self) -> None:
        self.solver.release()
        self.lightmap.release()


def begin(
    gpu: Gpu,
    scene: Scene,
    *,
    texels: int | None = None,
    density: float | None = None,
    tile: int = DEFAULT_TILE,
    adaptive: bool = False,
    audits: bool = True,
    solver: str = DEFAULT_SOLVER,
    **options: object,
) -> Solution:
    """The scene before any work. options: of LightmapOptions, and of solvers, each of which takes its own. Where leaves come and
    go, texels and density are those of the roots, which uniform texels are as fine as, and shooting levels count from there."""
    cut = cut_at_contacts(scene)
    scene, charts = cut.scene, parametrize(cut.scene, texels=texels, density=density, tile=tile, ends=cut.ends)
    held = {spec.name: options.pop(spec.name) for spec in specs(LightmapOptions) if spec.name in options}
    gathers = {spec.name: options.pop(spec.name) for spec in specs(GatheringOptions) if spec.name in options}
    if solver == "local":
        return Solution(
            *_local(gpu, TilePool(scene, charts) if not adaptive else quadtree_pool(scene, charts), options)
        )  # type: ignore[arg-type]
    shooting = ShootingOptions().replace(**options)
    pool = quadtree_pool(scene, charts) if adaptive else TilePool(scene, charts)
    if adaptive:
        shooting = shooting.replace(
            level=min((LEVEL if shooting.level is None else shooting.level) + ROOT_LEVEL, MAX_LEVEL)
        )
    lightmap = Lightmap(gpu, pool, LightmapOptions(adaptive=adaptive, depth=1).replace(**held))
    if solver == "gathering":
        gathering = GatheringOptions(noise=NOISE).replace(**gathers)
        return Solution(lightmap, Gathering(gpu, lightmap, gathering))  # type: ignore[arg-type]
    return Solution(lightmap, Shooting(gpu, lightmap, shooting, audits=audits))


def _local(gpu: Gpu, pool: TilePool, options: Mapping[str, object]) -> tuple[Lightmap, Local]:
    """Raises UserError, and releases the lightmap."""
    lightmap = Lightmap(gpu, pool)
    try:
        return lightmap, Local(gpu, lightmap, LocalOptions().replace(**options))
    except UserError:
        lightmap.release()
        raise


def solve(gpu: Gpu, scene: Scene, **options: object) -> Solution:
    """``begin`` and shoot until converged and settled."""
    solution = begin(gpu, scene, **options)  # type: ignore[arg-type]
    solution.settle()
    return solution


def gathered(gpu: Gpu, scene: Scene, rays: int = RAYS, **options: object) -> Solution:
    """``begin`` and gather so many rays of each texel; light is not smoothed."""
    known: dict[str, object] = {"density": 4, "smooth": False}
    lit = begin(gpu, scene, solver="gathering", **(known | options))  # type: ignore[arg-type]
    lit.gather(rays)
    return lit
