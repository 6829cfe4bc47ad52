"""A session as a program drives it: what restarts the light and what does not, when a solve stops, and that nothing is left
behind by a scene that was closed."""

from __future__ import annotations

import dataclasses
import os
import time
from collections.abc import Callable

import numpy as np
import psutil
import pytest
from furnace_session import ATLAS, SHOOTING, irradiance, session, view
from gl_objects import forgotten, held

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.lightmap.options import STORAGE, LightmapOptions
from app.render.false_colour import colour_map
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View
from app.viewer.picture import picture

__all__ = ["forgotten", "session", "view"]


# -- shooting ----------------------------------------------------------------------------------------------------------


def test_watching_makes_one_shot_and_fast_a_batch_or_more(session: Session) -> None:
    assert session.advance() == 1
    assert irradiance(session) > 0
    assert sum(session.advance(fast=True) for _ in range(10)) >= 8  # where frames are slow, a batch takes several


def test_paused_and_converged_sessions_do_not_shoot(session: Session) -> None:
    session.run.running = False
    assert session.advance() == 0
    assert irradiance(session) == 0
    session.work()
    assert irradiance(session) > 0
    session.run.running = True
    session.solve(Stop())
    assert session.run.converged
    shots = session.solver.issued
    assert session.advance() == 0
    session.set_options(session.options.replace(residual=0.01))  # not enough any more
    assert session.advance() == 1
    assert session.solver.issued > shots


def test_solve_stops_after_shots(session: Session) -> None:
    heard: list[int] = []
    session.solve(Stop(work=12), tell=lambda stats: heard.append(stats.done))
    assert session.solver.issued == 12 and not session.run.converged
    assert heard == sorted(heard)
    assert session.stats.done == 12
    assert session.run.share_done(Stop(work=24)) >= 0.5


def test_solve_stops_after_seconds(session: Session) -> None:
    session.set_options(session.options.replace(residual=1e-9, level=0, coarsen=False))
    start = time.perf_counter()
    session.solve(Stop(seconds=0.3))
    assert not session.run.converged
    assert session.solver.issued > 0
    assert 0.3 <= session.run.seconds < time.perf_counter() - start + 0.01


def test_solve_runs_to_convergence_and_knows_it(session: Session) -> None:
    session.solve(Stop())
    stats = session.stats
    assert stats.converged and stats.remaining <= 0.05
    assert stats.unshot <= 0.05 * stats.emitted
    assert stats.absorbed + stats.escaped + stats.unshot == pytest.approx(
        stats.emitted, rel=5e-3
    )  # form factors: 0.5 %
    assert session.run.history.column("work")[-1] == stats.done
    assert session.run.share_done(Stop()) == 1


def test_a_solve_that_still_shoots_is_not_all_done(session: Session) -> None:
    session.solve(Stop())
    session.run.progress = dataclasses.replace(session.run.progress, converged=False)
    assert 0.9 < session.run.share_done(Stop()) < 1
    assert session.run.share_done(Stop(work=session.solver.issued)) == 1  # all that was asked for


def test_history_has_all_that_was_heard_of_whoever_asked(session: Session) -> None:
    """The window asks the solver between two polls, when it says where the eye is."""
    for _ in range(6):
        session.advance(fast=False, interactive=False)
        session.gpu.ctx.finish()
        session.observe(np.zeros(3))
        session.poll()
    work = session.run.history.column("work")
    assert len(work) > 4 and work[-1] == session.run.progress.done


def test_a_piece_of_work_ends_its_frame_only_where_the_balance_is_then_measured(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After an edit it is due, but waits for the next one, which may follow at once."""
    ended: list[bool] = []
    monkeypatch.setattr(session.run._pace, "advance", lambda solver, **how: ended.append(how["to_end"]) or 0)
    monkeypatch.setattr("app.session.energy.EDIT_SECONDS", 60.0)
    session.run.flicker(session.materials)
    session.advance()
    monkeypatch.setattr("app.session.energy.EDIT_SECONDS", 0.0)
    session.run.flicker(session.materials)
    session.advance()
    assert ended == [False, True]


# -- what begins again -------------------------------------------------------------------------------------------------


def test_another_material_changes_the_light_that_is_there(session: Session) -> None:
    session.solve(Stop())
    dim, texels, shots = irradiance(session), session.lightmap.texel_count, session.solver.issued
    lightmap = session.lightmap
    session.set_material(0, dataclasses.replace(session.scene.materials[0], albedo=(0.75, 0.75, 0.75)))
    assert irradiance(session) == dim and session.solver.issued == shots and not session.run.converged
    assert session.lightmap is lightmap and session.lightmap.texel_count == texels  # nothing was unfolded again
    session.solve(Stop())
    # B = E / (1 - ρ), H = E / (1 - ρ): twice as much at ρ = 0.75 as at 0.5, but for 5 % of light that is not yet shot
    assert irradiance(session) == pytest.approx(2 * dim, rel=0.1)


@pytest.mark.parametrize(
    ("change", "restarts"),
    [
        ({"level": 3}, False),
        ({"visibility": "depth"}, False),
        ({"form_factor": "disc", "discs": 2}, False),
        ({"resolution": 128}, False),
        ({"residual": 0.5}, False),
        ({"storage": "rgba16f"}, True),
        ({"storage": "fixed8"}, True),
    ],
    ids=str,
)
def test_only_another_storage_restarts(session: Session, change: dict[str, object], restarts: bool) -> None:
    session.solve(Stop(work=8))
    before = irradiance(session)
    if "storage" in change:
        session.set_light(session.light.replace(**change))
    else:
        session.set_options(session.options.replace(**change))
    assert irradiance(session) == (0 if restarts else before)
    assert session.solver.issued == (0 if restarts else 8)
    session.solve(Stop(work=session.solver.issued + 8))
    assert irradiance(session) > (0 if restarts else before)  # it shoots with the new options


def test_restart_begins_again(session: Session) -> None:
    session.solve(Stop(work=8))
    first = irradiance(session)
    session.restart()
    assert irradiance(session) == 0 and session.solver.issued == 0 and session.run.seconds == 0
    session.solve(Stop(work=8))
    assert irradiance(session) == first


def test_options_that_change_no_light_keep_what_is_known_of_it(session: Session) -> None:
    session.solve(Stop(work=16))
    session.estimate_now(lambda share: None)
    known = session.expected
    assert known is not None
    session.set_options(session.options.replace(residual=0.9))
    assert session.expected is known
    session.set_options(session.options.replace(ambient=False))
    assert session.expected is None, "other light is shown"


# -- nothing is left behind --------------------------------------------------------------------------------------------


def test_reloading_leaves_nothing_behind(gpu: Gpu, forgotten: Callable[[], list[object]]) -> None:
    """8 scenes opened, lit and closed again; the first few let caches fill."""
    process = psutil.Process(os.getpid())
    session = Session(gpu, options=SHOOTING, atlas=ATLAS)
    counts, megabytes = [], []
    for k in range(12):
        session.open_now(("furnace", "cornell-box")[k % 2])
        session.advance()  # leaves a read-back in flight
        for level in (3, 2):
            session.set_options(session.options.replace(level=level))
        if k % 2:
            counts.append(held(gpu))
            megabytes.append(process.memory_info().rss / 2**20)
    assert len(set(counts[2:])) == 1, counts
    assert not forgotten()
    # 8 reloads of a scene of about 3 MiB; malloc keeps some of what it has given once
    assert megabytes[-1] - megabytes[2] < 8, megabytes
    session.release()


def test_release_gives_everything_back(gpu: Gpu, forgotten: Callable[[], list[object]]) -> None:
    before = held(gpu)
    programs = len(gpu.shaders._programs)
    session = Session(gpu, options=SHOOTING, atlas=ATLAS)
    session.open_now("cornell-box")
    session.solve(Stop(work=20))
    assert held(gpu) > before + 10
    session.release()
    kept = len(gpu.shaders._programs) - programs  # the shader library keeps programs and their empty vertex arrays
    assert held(gpu) - before <= 2 * kept
    assert not forgotten()


@pytest.mark.parametrize("storage", STORAGE)
def test_picking_reads_the_light_and_changes_none(view: View, session: Session, storage: str) -> None:
    session.open_now("cornell-box")
    session.set_light(session.light.replace(storage=storage))
    session.solve(Stop(work=8))
    before = session.lightmap.irradiance()
    texture = session.gpu.texture((64, 48), 4, "f1")
    target = session.gpu.target(texture)
    view.draw(target, (64, 48))
    picked = view.pick(10, 24)  # the left wall
    assert picked is not None and max(picked.H) > 0
    (column, row), columns = picked.texel, session.lightmap.columns
    tile = session.charts.tile
    at = row // tile * columns + column // tile, row % tile, column % tile
    np.testing.assert_allclose(picked.H, before[at], rtol=1e-6)
    np.testing.assert_allclose(picked.r, session.lightmap.residual()[at], rtol=1e-6)
    np.testing.assert_allclose(picked.B, np.add(picked.E, np.multiply(picked.albedo, picked.H)), rtol=1e-6)
    np.testing.assert_array_equal(session.lightmap.irradiance(), before)
    session.gpu.release_all(target, texture)


def test_a_picked_point_is_found_again_in_a_tree_that_grew(gpu: Gpu) -> None:
    session = Session(gpu, atlas=AtlasOptions(texels=1500), light=LightmapOptions(adaptive=True))
    view = View(session)
    session.open_now("cornell-box")
    texture = gpu.texture((64, 48), 4, "f1")
    target = gpu.target(texture)
    view.draw(target, (64, 48))
    first = {at: view.pick(*at) for at in ((10, 24), (32, 40), (40, 44), (40, 12))}
    session.solve(Stop(work=500))
    again = {at: view.read_again(picked) for at, picked in first.items()}
    assert any(again[at].texel != first[at].texel for at in first), "leaves have split under some of the points"
    for at, picked in again.items():
        assert picked.position == first[at].position and picked.triangle == first[at].triangle
        assert picked.H == view.pick(*at).H != first[at].H, "as if picked now"
    session.open_now("furnace")
    assert view.pick(32, 24) is None, "what was drawn last is not what is open"
    view.release()
    session.release()
    gpu.release_all(target, texture)


def test_a_false_colour_picture_has_its_legend(view: View, session: Session) -> None:
    session.open_now("cornell-box")
    session.solve(Stop(work=30))
    view.display = view.display.replace(false_colour="illuminance", layer="albedo")
    image = picture(view, (640, 360)) / 255
    corner = image[:300, :140]
    for colour in colour_map(48)[[0, 12, 24, 36, 47]]:
        assert (np.abs(corner - colour).max(-1) < 1.5 / 255).sum() > 30, "every part of the scale is there"
    view.display = view.display.replace(false_colour="off")
    plain = picture(view, (640, 360))[:300, :140] / 255
    assert (np.abs(plain - colour_map(48)[24]).max(-1) < 1.5 / 255).sum() == 0
