"""A solution beside a reference: numbers at random points, and references that come and go."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import pickle
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import psutil
import pytest
from boxes import PLAIN, box, cornell, even, light_of, put, put_ambient, smooth
from forests import Forest, forest
from furnace_session import SHOOTING, session, view
from gl_objects import forgotten, held
from numpy.typing import NDArray
from processes import started
from solver_scenes import table_room

from app.atlas.options import AtlasOptions
from app.atlas.points import random_points
from app.bake import write_bake
from app.bake.options import BakeOptions
from app.compare.comparison import POINTS, POINTS_SEED
from app.compare.options import ReferenceOptions
from app.compare.reference_light import ReferenceLight
from app.compare.reference_texels import ReferenceTexels
from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.at_points import irradiance_of
from app.lightmap.collapse import collapse
from app.lightmap.lightmap import Lightmap
from app.lightmap.options import LightmapOptions
from app.lightmap.probe import Probe
from app.lightmap.tile_pool import TilePool
from app.reference.metrics import lit_points, point_errors
from app.scene.model import F32, Scene
from app.session.comparison_worker import INTERRUPTED
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View
from app.viewer.picture import picture as shot

__all__ = ["box", "cornell", "forest", "forgotten", "session", "view"]


# -- numbers -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("storage", ["rgba32f", "rgba16f", "fixed8"])
def test_the_probe_reads_what_is_drawn(gpu: Gpu, box: Lightmap, storage: str) -> None:
    """Bilinear as in a bake, gutters included: noise shows any other texel."""
    box.set_storage(storage)
    box.clear()
    if storage == "rgba32f":
        put(box, "t_irradiance", even(box, (1, 1, 1)) * np.random.default_rng(3).uniform(1, 2, (box.tiles, 16, 16, 1)))
    else:
        box.light_target.clear(*[2.0 / box.unit] * 3, 0.0)
    points = random_points(box.scene, 500, 1)
    probe = Probe(gpu, box, points)
    found, expected = probe.irradiance(probe.look()), irradiance_of(box, points)
    # a place in the atlas is a 32-bit float there: 1e-5 of a texel, of which the noise is 1 at most
    np.testing.assert_allclose(found, expected, atol=5e-5)
    probe.release()


def test_the_probe_reads_quadtrees(gpu: Gpu) -> None:
    """Light of leaves of several levels is what their texels hold, within what it changes by over the largest."""
    session = Session(gpu, options=SHOOTING, atlas=AtlasOptions(texels=900), light=LightmapOptions(adaptive=True))
    session.open_now("cornell-box")
    session.solve(Stop(work=60))
    lightmap = session.lightmap
    assert np.ptp(lightmap.pool.leaves.level[lightmap.pool.used]) > 0
    tiles = smooth(lightmap)
    put(lightmap, "t_irradiance", tiles)
    put_ambient(lightmap, (0.0, 0.0, 0.0))
    points = random_points(session.scene, 500, 2)
    probe = Probe(gpu, lightmap, points)
    local = lightmap.space.local_from_world(points.positions_normals(session.scene)[0])
    expected = 2.0 + local @ np.array([[0.5, 0, 0.2], [0.1, 0.4, 0], [0, 0.2, 0.3]])
    size = 1.0 / (lightmap.charts.density * lightmap.space.scale)  # of a texel of level 0, solver space
    # half a texel's diagonal where only one is near; light changes by 0.6 at most per unit in any channel
    assert np.abs(probe.irradiance(probe.look()) - expected).max() <= 0.6 * size
    probe.release()
    session.release()


def baked(session: Session, folder: Path, factor: float = 1.0) -> Path:
    """The light of a session, times a factor."""
    irradiance, covered = collapse(session.lightmap.pool, session.lightmap.irradiance(ambient=True))
    report = {"texels": session.lightmap.texel_count, "residual": session.stats.remaining}
    light = np.float32(factor) * irradiance, covered
    write_bake(folder, session.scene, session.charts, *light, report, BakeOptions(exr_float=True))
    return folder


def frames(session: Session, until: Callable[[], bool], *, fast: bool = True) -> None:
    """Go on until then, as the window does."""
    end = time.monotonic() + 60
    while not until():
        assert time.monotonic() < end
        session.poll()
        session.advance(fast=fast)
        time.sleep(0.001)


def test_the_error_against_a_bake_is_that_of_its_light(session: Session, tmp_path: Path) -> None:
    session.solve(Stop())
    session.compared.open_now(baked(session, tmp_path, 2.0))
    session.compare(wait=True)
    assert session.compared.comparison is not None and session.compared.comparison.error is not None
    # in a furnace light is all but even: interpolated at gutters or not, it differs by less than 1 % of itself
    assert session.compared.comparison.error == pytest.approx((0.5, -0.5, 0.5, 0.5), abs=0.01)
    points = random_points(session.scene, POINTS, POINTS_SEED)
    reference = session.compared.comparison.light.at(points)
    lit = lit_points(reference)
    expected = point_errors(irradiance_of(session.lightmap, points)[lit], reference[lit])
    assert session.compared.comparison.error == pytest.approx(expected, abs=1e-3)


def test_the_error_falls_while_light_is_shot(session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.compare.comparison.SECONDS", 0.0)
    session.solve(Stop())
    session.compared.open_now(baked(session, tmp_path))
    session.restart()
    comparison = session.compared.comparison
    assert comparison is not None and not session.at_rest
    frames(session, lambda: session.at_rest, fast=False)
    rms, shots = (comparison.errors.column(name) for name in ("rms", "work"))
    assert len(rms) > 3 and (np.diff(shots) > 0).all() and shots[-1] == session.solver.issued
    # what lamps have yet to give is shown where they gave: here each wall is one, and the next lights another place
    assert rms[0] > 0.5 and rms[-1] < 0.02 and (np.diff(rms) < 0.02).all()
    session.restart()
    assert len(comparison.errors.column("rms")) == 0


def test_a_texel_has_its_reference(session: Session, tmp_path: Path) -> None:
    session.solve(Stop(work=20))
    assert session.compared.irradiance_at((0, 0)) is None
    session.compared.open_now(baked(session, tmp_path, 3.0))
    lightmap = session.lightmap
    tile, row, column = (int(n[7]) for n in np.nonzero(lightmap.pool.surfaces.area > 0))
    corner = lightmap.pool.corner(tile)
    texel = corner[0] + column, corner[1] + row
    there = lightmap.irradiance(ambient=True)[tile, row, column]
    assert session.compared.irradiance_at(texel) == pytest.approx(3 * there, rel=1e-5)
    comparison, pool = session.compared.comparison, lightmap.pool
    assert comparison is not None
    image = np.frombuffer(comparison.texels.texture.read(), np.float32).reshape(*pool.size[::-1], 4)
    all_of_them = comparison.light.on_tiles(pool, np.arange(pool.tiles))
    np.testing.assert_array_equal(pool.tiles_from_image(image)[..., :3], all_of_them, err_msg="before any frame asks")


def test_an_edit_is_measured_and_said(session: Session, tmp_path: Path) -> None:
    session.solve(Stop())
    session.compared.open_now(baked(session, tmp_path))
    frames(session, lambda: session.at_rest)
    comparison, material = session.compared.comparison, session.scene.materials[0]
    assert comparison is not None and comparison.error is not None and comparison.error.rms < 0.01
    assert comparison.notes(session.lightmap) == []
    session.set_material(0, dataclasses.replace(material, emission=(2 * material.emission[0],) * 3))
    assert not session.at_rest
    frames(session, lambda: session.at_rest)
    assert comparison.error.rms == pytest.approx(1.0, abs=0.1)  # twice the light
    assert comparison.notes(session.lightmap) == [f"the reference was solved with other materials: {material.name}"]


def test_the_reference_follows_the_leaves(gpu: Gpu, tmp_path: Path) -> None:
    session = Session(gpu, options=SHOOTING, atlas=AtlasOptions(texels=900), light=LightmapOptions(adaptive=True))
    session.open_now("cornell-box")
    session.solve(Stop(work=20))
    lightmap = session.lightmap
    light = light_of(lightmap, lightmap.irradiance())
    texels = ReferenceTexels(gpu, lightmap, light)
    for shots in (20, 60, 120):
        session.solve(Stop(work=shots))
        version = lightmap.version
        texels.follow(whole=shots != 60)
        pool = lightmap.pool
        image = np.frombuffer(texels.texture.read(), np.float32).reshape(*pool.size[::-1], 4)
        held_ = pool.tiles_from_image(image)[pool.used][..., :3]
        np.testing.assert_array_equal(held_, light.on_tiles(pool, np.flatnonzero(pool.used)), err_msg=str(shots))
    assert version > 0
    texels.release()
    session.release()


def test_a_node_set_that_is_resized_is_not_looked_up_at_once(
    gpu: Gpu, forest: Callable[..., Forest], rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Leaves that stay, moved or not, take their texels along; of those that are new a part comes in each frame."""
    trees = forest(table_room())
    for _ in range(2):
        trees.grow()
    siblings = trees.tree.merges(np.flatnonzero(trees.pool.used))
    trees.transfer.apply(trees.tree.merge([family for family in siblings if rng.random() < 0.7]))
    trees.write_noise(rng)
    lightmap, pool = trees.lightmap, trees.pool
    light = light_of(lightmap, lightmap.irradiance())
    texels = ReferenceTexels(gpu, lightmap, light)
    texels.follow(whole=True)
    look_up, prepare_reference = ReferenceLight.on_tiles, []

    def on_tiles(self: ReferenceLight, pool: TilePool, slots: NDArray[np.int64]) -> F32:
        prepare_reference.append(len(slots))
        return look_up(self, pool, slots)

    def complete() -> bool:
        image = np.frombuffer(texels.texture.read(), np.float32).reshape(*pool.size[::-1], 4)
        found = pool.tiles_from_image(image)[pool.used][..., :3]
        return bool((found == look_up(light, pool, np.flatnonzero(pool.used))).all())

    monkeypatch.setattr(ReferenceLight, "on_tiles", on_tiles)
    assert complete()
    moves = trees.tree.resize(len(trees.tree) + 5)
    lightmap.resize(moves)
    texels.follow(whole=False)
    assert len(moves.old) > 20 and sum(prepare_reference) == 0 and complete()
    monkeypatch.setattr("app.compare.reference_texels.TEXELS_PER_FRAME", 20 * pool.tile**2)
    rows = pool.rows
    trees.grow(0.3, rng)
    texels.follow(whole=False)
    assert pool.rows > rows and sum(prepare_reference) == 20 and not complete()
    for _ in range(-(-pool.tiles // 20)):
        texels.follow(whole=False)
    assert complete() and max(prepare_reference) == 20 and sum(prepare_reference) < len(trees.tree)
    texels.release()


def test_without_a_reference_the_solution_is_shown(view: View, session: Session) -> None:
    session.solve(Stop(work=8))
    plain = shot(view, (64, 48))
    for change in ({"layer": "error"}, {"show": "reference"}, {"show": "split"}):
        view.display = PLAIN.replace(**change)
        view.display = view.display.replace(tone_map="agx")
        assert (shot(view, (64, 48)) == plain).all()


# -- references come and go --------------------------------------------------------------------------------------------


def test_a_reference_stays_with_its_scene(view: View, session: Session, tmp_path: Path) -> None:
    session.solve(Stop())
    session.compared.open(baked(session, tmp_path))
    frames(session, lambda: session.compared.fetching is None)
    first = session.compared.comparison
    assert first is not None and session.message is None
    session.cut_anew(AtlasOptions(texels=2000))
    frames(session, lambda: session.loading is None)
    assert session.compared.comparison is not None and session.compared.comparison is not first
    frames(session, lambda: session.at_rest)
    error = session.compared.comparison.error
    # a furnace that reflects half; both to a residual of 0.05, which is missing twice, or was shot ahead
    assert error is not None and error.rms < 0.1
    view.display = view.display.replace(layer="error", show="split")
    session.open_now("cornell-box")
    assert session.compared.comparison is None
    assert (view.display.layer, view.display.show) == ("combined", "solution")


def test_a_reference_of_another_scene_is_said(session: Session, tmp_path: Path) -> None:
    session.solve(Stop(work=4))
    folder = baked(session, tmp_path)
    session.open_now("cornell-box")
    session.compared.open(folder)
    frames(session, lambda: session.compared.fetching is None)
    assert session.compared.comparison is None and "is of another scene" in str(session.message)
    with pytest.raises(UserError, match="is of another scene"):
        session.compared.open_now(folder)


def test_a_black_reference_is_none(session: Session, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="holds no light"):
        session.compared.open_now(baked(session, tmp_path))


def test_releasing_leaves_nothing_behind(
    view: View, gpu: Gpu, session: Session, tmp_path: Path, forgotten: Callable[[], list[object]]
) -> None:
    session.solve(Stop(work=20))
    folder = baked(session, tmp_path)
    counts = []
    for _ in range(2):  # programs that were compiled once stay
        session.compared.open_now(folder)
        view.display = view.display.replace(show="split")
        shot(view, (64, 48))
        session.poll()  # a measurement stays on its way
        view.drop_reference()
        shot(view, (64, 48))
        counts.append(held(gpu))
    assert counts[0] == counts[1] and not forgotten()


# -- solved in the background ------------------------------------------------------------------------------------------


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(tmp_path / "cache"))
    return tmp_path / "cache" / "reference"


def workers() -> list[psutil.Process]:
    found = []
    for process in psutil.Process().children():
        with contextlib.suppress(psutil.NoSuchProcess):  # it may end meanwhile
            if "app.session.comparison_worker" in process.cmdline():
                found.append(process)
    return found


def test_a_finer_solve_is_a_reference(session: Session, own_cache: Path) -> None:
    """A furnace: its answer is known. What the worker wrote is there at once the next time."""
    session.run.running = False
    options = ReferenceOptions(texels=1500, residual=1e-2)
    session.compared.solve(options)
    assert session.compared.fetching is not None and not session.at_rest
    frames(session, lambda: session.compared.fetching is None)
    assert session.message is None and not workers()
    comparison = session.compared.comparison
    assert comparison is not None and comparison.light.texels is not None and comparison.light.unshot is not None
    assert comparison.light.texels > session.lightmap.texel_count and comparison.light.unshot <= 1e-2
    material = session.scene.materials[0]
    H = np.pi * material.emission[0] / (1 - material.albedo[0])
    # what is unshot, and 2 % for form factors and visibility of coarse texels
    assert comparison.light.at(random_points(session.scene, 100, 1)) == pytest.approx(H, rel=1e-2 + 0.02)
    (kept,) = own_cache.glob("*.npz")
    written = kept.stat().st_mtime_ns
    session.compared.solve(options)
    frames(session, lambda: session.compared.fetching is None)
    assert session.compared.comparison is not comparison and kept.stat().st_mtime_ns == written
    session.compared.solve(options.replace(residual=1e-9))
    frames(session, lambda: bool(workers()))
    if hasattr(os, "getsid"):
        assert all(os.getsid(worker.pid) == worker.pid for worker in workers()), "Ctrl-C would reach it"
    session.compared.stop_fetching()
    gone = time.monotonic() + 10
    while workers():
        assert time.monotonic() < gone, "still there"
        time.sleep(0.05)
    assert session.compared.comparison is not None and session.compared.fetching is None


@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")
def test_an_interrupted_solve_is_no_answer(cornell: Scene, tmp_path: Path) -> None:
    source, target = tmp_path / "in.pickle", tmp_path / "out.npz"
    source.write_bytes(pickle.dumps({"scene": cornell, "atlas": AtlasOptions(texels=900), "residual": 1e-9}))
    command = [sys.executable, "-m", "app.session.comparison_worker", str(source), str(target)]
    env = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    with started(command, env) as worker:
        assert worker.stdout is not None
        assert any(" shots" in line for line in worker.stdout)
        worker.send_signal(signal.SIGINT)
        assert worker.wait(30) == INTERRUPTED
    assert not target.exists()
