"""Texel pairs: a furnace, every mode against all pairs, what is kept and what is refused, and that a bounce stops anywhere."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from solver_scenes import UNIT_SQUARE, grey, quads_scene, room, table_room

from app.atlas.options import AtlasOptions
from app.atlas.parametrize import parametrize
from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.lightmap.quadtree import quadtree_pool
from app.lightmap.tile_pool import TilePool
from app.scene.lights import Light
from app.scene.model import F64, Scene
from app.scene.sky import Sky
from app.session.run import Stop
from app.session.session import Session
from app.solvers import ShootingOptions
from app.solvers.pairs.kept import words_of
from app.solvers.pairs.options import KEPT_TEXELS, PairsOptions, check
from app.solvers.pairs.senders import sender_table
from app.solvers.pairs.solver import Pairs
from app.util.parts import run_to_end
from app.visibility.voxels import occupied_cells

MODES: dict[str, tuple[dict[str, Any], float, float]] = {
    # options, and by how much their light may differ from that of all pairs, over its mean: RMS, and mean. About twice what is
    # measured: that of a lamp of 3 × 3 texels in windows of 2 × 2, of which stride takes one, and chance another one each time.
    "stride": ({"senders": "stride", "window": 2}, 0.6, 0.08),
    "monte-carlo": ({"senders": "monte-carlo", "window": 2}, 0.6, 0.03),
    "mipmapped": ({"senders": "mipmapped", "window": 2}, 0.15, 0.015),
    "quadtree": ({"senders": "quadtree", "window": 4}, 0.10, 0.015),
    "directional": ({"senders": "directional", "directions": 1024}, 0.07, 0.015),
    "hemicube": ({"senders": "all", "occlusion": "hemicube"}, 0.04, 0.005),
    "voxels": ({"senders": "all", "occlusion": "voxels", "voxels": 128}, 0.05, 0.02),
}


class Solved:
    """A scene with its pairs. H (n, 3) [W/m²] and area (n, 1) of the texels that cover a surface."""

    def __init__(self, gpu: Gpu, scene: Scene, density: float, **options: Any) -> None:
        self.lightmap = Lightmap(gpu, TilePool(scene, parametrize(scene, density=density)))
        self.solver = Pairs(gpu, self.lightmap, PairsOptions(**options))
        self._covered = self.lightmap.pool.surfaces.area > 0
        self.area = self.lightmap.pool.surfaces.area[self._covered][:, None]

    def bounce(self, count: int) -> F64:
        """So many more bounces; H then."""
        last = self.solver.issued + count
        while self.solver.issued < last:
            run_to_end(self.solver.work(1))
        return self.H

    def anew(self, count: int, **options: Any) -> F64:
        self.solver.set_options(PairsOptions(**options))
        self.solver.reset()
        return self.bounce(count)

    @property
    def H(self) -> F64:
        return self.lightmap.irradiance()[self._covered].astype(np.float64)

    def mean(self, values: F64) -> float:
        return float((values * self.area).sum() / (3 * self.area.sum()))

    def release(self) -> None:
        self.solver.release()
        self.lightmap.release()


@pytest.fixture
def even_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of so many pairs, however fast they are: sums are then rounded alike."""
    monkeypatch.setattr("app.solvers.pairs.pace.GROWTH", 1)
    for place in ("pace", "solver"):
        monkeypatch.setattr(f"app.solvers.pairs.{place}.PART", 1e9)


def test_a_furnace_is_as_bright_everywhere_as_it_must_be(gpu: Gpu) -> None:
    """H = B = E / (1 - ρ) = 2. Form factors sum up to 1 within 0.2 % where texels are an eighth of a wall: squares close by,
    points further away than CLOSE of sender.glsl. H has Σ ρⁿ = 2 times as much of that."""
    furnace = Solved(gpu, quads_scene(room(), [grey(0.5, 1.0)]), 8.0, senders="all", change=1e-3)
    while not furnace.solver.poll().converged:
        furnace.bounce(1)
    H, books = furnace.H, furnace.solver.energy()
    assert np.abs(H - 2.0).max() < 2 * 0.004 and furnace.mean(H) == pytest.approx(2.0, rel=0.002)
    assert books.emitted == pytest.approx(6.0) and abs(books.imbalance_share) < 1e-4
    assert np.abs(books.escaped).max() < 0.004 * 6, "form factors of a closed room sum up to 1"
    furnace.release()


@pytest.fixture(scope="module")
def table() -> Iterator[dict[str, Any]]:
    """A room with a table, solved by all pairs, once."""
    made: dict[str, Any] = {}
    yield made
    if made:
        made["room"].release()


@pytest.mark.parametrize("name", MODES)
def test_every_mode_agrees_with_all_pairs(gpu: Gpu, table: dict[str, Any], name: str) -> None:
    if not table:
        table["room"] = Solved(gpu, table_room(), 3.0, senders="all")
        table["H"] = table["room"].bounce(3)
    options, rms, mean = MODES[name]
    right, tables = table["H"], table["room"]
    H = tables.anew(3, **options)
    level = tables.mean(right)
    assert not np.array_equal(H, right)
    assert np.sqrt(tables.mean((H - right) ** 2)) / level < rms
    assert tables.mean(H) / level == pytest.approx(1.0, abs=mean)


@pytest.mark.parametrize(
    "options",
    [
        {"senders": "all"},
        {"senders": "stride", "window": 2},
        {"senders": "mipmapped", "window": 2},
        {"senders": "stride", "window": 2, "occlusion": "voxels", "voxels": 32},
    ],
    ids=lambda o: "-".join(map(str, o.values())),
)
def test_kept_pairs_are_those_that_see_each_other(gpu: Gpu, even_parts: None, options: dict[str, Any]) -> None:
    """The same numbers to the last bit, by one bit for both directions where texels send."""
    kept = Solved(gpu, table_room(), 2.0, **options)
    right = kept.bounce(2)
    np.testing.assert_array_equal(kept.anew(2, keep_pairs=True, **options), right)
    assert right.max() > 0
    kept.release()


def test_words_of_kept_pairs() -> None:
    """A triangle of 64 senders has Σ (⌊i/32⌋ + 1) words, and each of 10 more texels two; without reciprocity all have two."""
    assert words_of(74, 64, True) == 32 * 1 + 32 * 2 + 10 * 2
    assert words_of(74, 64, False) == 74 * 2
    assert words_of(KEPT_TEXELS, KEPT_TEXELS, True) * 4 == pytest.approx(256 * 2**20, rel=1e-3)


@pytest.mark.parametrize(
    ("options", "texels", "says"),
    [
        (
            {"keep_pairs": True, "senders": "monte-carlo"},
            9,
            "--keep-pairs with --senders monte-carlo: the pairs are others",
        ),
        ({"keep_pairs": True, "senders": "quadtree"}, 9, "nodes change with the light; use all, stride or mipmapped"),
        ({"keep_pairs": True, "senders": "directional"}, 9, "a direction is no pair"),
        ({"keep_pairs": True, "senders": "all", "occlusion": "hemicube"}, 9, "a bit holds no part of a view"),
        ({"keep_pairs": True, "senders": "all"}, KEPT_TEXELS + 1, "65,537 texels would take 256 MiB; at most 65,536"),
        ({"senders": "directional", "occlusion": "voxels"}, 9, "only rays find what they meet"),
        ({"senders": "monte-carlo", "occlusion": "hemicube"}, 9, "a map is drawn for a sender that all texels share"),
    ],
)
def test_refused_with_a_reason_in_one_line(options: dict[str, Any], texels: int, says: str) -> None:
    with pytest.raises(UserError, match=says) as error:
        check(PairsOptions(**options), texels)
    assert "\n" not in str(error.value)


def test_quadtree_lightmaps_are_refused(gpu: Gpu) -> None:
    scene = quads_scene([UNIT_SQUARE], [grey(0.5, 1.0)])
    lightmap = Lightmap(gpu, quadtree_pool(scene, parametrize(scene, density=4.0)))
    with pytest.raises(UserError, match="not with --adaptive"):
        Pairs(gpu, lightmap, PairsOptions())
    lightmap.release()


@pytest.mark.parametrize("occlusion", ["rays", "voxels", "hemicube"])
def test_a_wall_blocks(gpu: Gpu, occlusion: str) -> None:
    """A lamp, a square that faces it at distance 1, and between them nothing, then a wall twice as wide that blocks all of it."""
    lamp, facing = UNIT_SQUARE, UNIT_SQUARE[::-1] + np.array([0.0, 0.0, 1.0])
    wall = UNIT_SQUARE * (2, 2, 1) + np.array([-0.5, -0.5, 0.5])
    received = []
    for between in ([], [wall]):
        scene = quads_scene([lamp, facing, *between], [grey(0.0, 1.0), grey(0.0)], [0, 1, 1][: 2 + len(between)])
        solved = Solved(gpu, scene, 8.0, senders="all", occlusion=occlusion, voxels=32)
        H = solved.bounce(1)[:, 0]
        z = solved.lightmap.pool.surfaces.position[solved.lightmap.pool.surfaces.area > 0][:, 2]
        received.append(float(H[np.abs(z - 1) < 1e-6].mean()))
        solved.release()
    assert received[0] == pytest.approx(0.1998, rel=0.01), "the squares' form factor; texels of 1/8 of their distance"
    assert received[1] == 0.0


def test_every_point_of_a_triangle_is_in_an_occupied_cell(rng: np.random.Generator) -> None:
    corners = rng.random((20, 3, 3))
    weights = rng.dirichlet((1, 1, 1), 4000)
    points = np.einsum("pk,nkc->npc", weights, corners).reshape(-1, 3)
    cells = occupied_cells(corners, 32)
    x, y, z = np.floor(points * 32).astype(int).T
    assert cells[z, y, x].all()
    assert cells.mean() < 0.25, "and few others are"
    one = occupied_cells(np.array([[[0.1, 0.1, 0.51], [0.9, 0.1, 0.51], [0.1, 0.9, 0.51]]]), 32)
    assert one[16].sum() == one.sum() > 0, "a plane fills one layer"


def test_windows_are_ranges_that_have_all_area(gpu: Gpu) -> None:
    scene = table_room()
    pool = TilePool(scene, parametrize(scene, density=5.0))
    whole = pool.surfaces.area.sum() / pool.space.scale**2
    for mode, window in itertools.product(("stride", "mipmapped"), (1, 2, 16)):
        table = sender_table(pool, mode, window)
        assert table.place[:, 3].sum() == pytest.approx(whole, rel=1e-5), (mode, window)
        assert table.windows[:, 1].sum() == table.count == pool.texel_count
    for window in (4, 16):
        table = sender_table(pool, "all", window)
        for a, n in table.windows.astype(int):
            assert len(np.unique(table.texels[a : a + n, :2] // window, axis=0)) == 1, "texels of one square"
            assert len(np.unique(table.facing[a : a + n], axis=0)) == 1, "and of one of these flat charts"


def test_a_bounce_stops_anywhere_and_goes_on(gpu: Gpu, even_parts: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.solvers.pairs.solver.PIECE", 0.0)
    monkeypatch.setattr("app.solvers.pairs.pace.FIRST", 20_000)
    solved = Solved(gpu, table_room(), 2.0, senders="all")
    right = solved.bounce(1)
    solved.solver.reset()
    for _ in range(5):
        assert run_to_end(solved.solver.work(1)) == 0, "a piece, not the whole"
    part = solved.solver.work(1)
    next(part)
    before = solved.solver.settle()
    assert next(part, None) is None and before.done == solved.solver.issued == 0 and not before.converged
    assert 0 < float(solved.solver.inspect().facts["This bounce"].rstrip("%")) < 100
    assert 0 < np.count_nonzero(solved.H) < np.count_nonzero(right), "what is whole is shown"
    np.testing.assert_array_equal(solved.bounce(1), right)
    other = PairsOptions(senders="stride", window=2)
    solved.solver.set_options(other)
    unmixed = solved.bounce(1)
    solved.anew(1, senders="all")
    run_to_end(solved.solver.work(1))
    solved.solver.set_options(other)
    np.testing.assert_array_equal(solved.bounce(1), unmixed)
    solved.release()


def test_it_says_beforehand_what_a_bounce_takes(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.solvers.pairs.solver.LONG", 0.0)
    monkeypatch.setattr("app.solvers.pairs.solver.PIECE", 0.0)
    monkeypatch.setattr("app.solvers.pairs.pace.KNOWN", 0.0)
    monkeypatch.setattr("app.solvers.pairs.pace.FIRST", 10_000)
    solved = Solved(gpu, table_room(), 2.0, senders="all")
    while (note := solved.solver.poll().note) is None:
        run_to_end(solved.solver.work(1))
    assert solved.solver.issued == 0
    assert "a bounce takes about" in note and f"{len(solved.area) ** 2:,} pairs" in note
    solved.release()


def test_light_from_outside_is_a_part_of_each_bounce(gpu: Gpu) -> None:
    """An open floor receives I cos θ / d², E cos θ and π L, also after edits. In a closed room of albedo 1/2 all that a lamp
    sends out is absorbed, and walls receive twice that, as near as form factors of a furnace sum up to 1."""
    lamp = Light("lamp", intensity=(1.0, 2.0, 3.0), position=(0.5, 0.7, 0.6))
    sun = Light("sun", "directional", (1.0, 1.0, 2.0), direction=(0.6, 0.0, -0.8))
    open_floor = quads_scene([UNIT_SQUARE], [grey(0.0)]).with_lights((lamp, sun)).with_sky(Sky(colour=(0.1, 0.2, 0.3)))
    floor = Solved(gpu, open_floor, 8.0, senders="all")
    surfaces = floor.lightmap.pool.surfaces
    at, up = (of[surfaces.area > 0] for of in (surfaces.position, surfaces.normal))
    for strength in (1.0, 2.0):
        lights = tuple(replace(one, intensity=tuple(strength * i for i in one.intensity)) for one in (lamp, sun))
        floor.solver.set_lights(lights)
        floor.solver.set_sky(Sky(colour=(0.1, 0.2, 0.3), strength=strength))
        expected = sum(one.irradiance(at, up) for one in lights) + np.pi * strength * np.array([0.1, 0.2, 0.3])
        np.testing.assert_allclose(floor.bounce(2), expected, rtol=0.02)  # rays start anywhere on texels of 1/8 m
        assert abs(floor.solver.energy().imbalance_share) < 1e-4
    books = floor.solver.energy()
    for fewer in (lights[:1], ()):  # the books are those of the last bounce until the next, also where that is restored
        floor.solver.set_lights(fewer)
        floor.solver.restore(floor.solver.state())
        np.testing.assert_array_equal(floor.solver.energy().emitted, books.emitted)
        np.testing.assert_array_equal(floor.solver.energy().escaped, books.escaped)
    floor.release()
    closed = Solved(gpu, quads_scene(room(), [grey(0.5)]).with_lights((lamp,)), 6.0, senders="all", change=1e-3)
    received = (closed.bounce(12) * closed.area).sum(0)
    np.testing.assert_allclose(received, 2 * lamp.flux, rtol=0.01)
    assert abs(closed.solver.energy().imbalance_share) < 5e-3  # close by, A_i F_ij differs from A_j F_ji
    closed.release()


def test_an_edit_goes_on_from_the_light_that_is_there(gpu: Gpu) -> None:
    solved = Solved(gpu, table_room(), 2.0, senders="stride", window=2, change=1e-3)
    before = solved.bounce(12)
    assert solved.solver.poll().converged
    materials = tuple(replace(m, emission=tuple(2 * e for e in m.emission)) for m in solved.lightmap.scene.materials)
    solved.solver.set_materials(materials)
    assert not solved.solver.poll().converged
    np.testing.assert_allclose(solved.bounce(12), 2 * before, rtol=5e-3)
    solved.release()


def test_it_is_switched_to_and_from_while_others_run(gpu: Gpu) -> None:
    session = Session(gpu, options=ShootingOptions(resolution=64), atlas=AtlasOptions(texels=300))
    session.open_now("cornell-box")
    session.solve(Stop(work=8))
    shot = session.lightmap.irradiance()
    session.set_solver("pairs")
    assert not session.lightmap.irradiance().any() and session.solving
    session.set_options(PairsOptions(senders="stride", window=1))
    session.solve(Stop(work=1))
    assert session.stats.done == 1 and session.stats.unit == "bounces" and session.lightmap.irradiance().any()
    with pytest.raises(UserError, match="use rays or voxels"):
        session.set_options(PairsOptions(senders="all", occlusion="hemicube", keep_pairs=True))
    assert session.options == session.solver.options == PairsOptions(senders="stride", window=1)
    session.solve(Stop())
    assert session.run.converged
    for other in ("gathering", "pairs", "shooting"):
        session.set_solver(other)
        assert not session.lightmap.irradiance().any()
        session.solve(Stop(work=8 if other != "pairs" else 1))
    np.testing.assert_array_equal(session.lightmap.irradiance(), shot)
    session.release()
