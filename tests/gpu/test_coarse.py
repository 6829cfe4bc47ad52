"""Coarse light: where charts take a while, a scene is lit in coarse texels until they are there, and then in those."""

from __future__ import annotations

import dataclasses
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from coarse_light import PATIENCE, TEXELS, better, frames, view
from gl_objects import forgotten

from app.errors import GpuError
from app.gpu import Gpu
from app.lightmap import carry_over
from app.lightmap.options import LightmapOptions
from app.lightmap.textures import LightTextures
from app.scene.load import load_scene
from app.session import loading
from app.session import session as session_module
from app.session.session import Session
from app.session.view import View
from app.solvers.run import solve_until
from app.viewer.picture import picture

__all__ = ["better", "forgotten", "view"]

SIZE = (96, 96)


def mean_irradiance(session: Session) -> float:
    area = session.lightmap.pool.surfaces.area
    return float((session.lightmap.irradiance().mean(-1) * area).sum() / area.sum())


@pytest.mark.parametrize("adaptive", [False, True])
def test_coarse_light_appears_and_gives_way_to_better(view: View, better: threading.Event, adaptive: bool) -> None:
    """Camera, exposure and edits of that time stay; both give about the same light."""
    session = view.session
    session.light = LightmapOptions(adaptive=adaptive, depth=1)
    session.open("cornell-box")
    frames(session, lambda: session.opened)
    assert session.coarse and session.loading is not None
    assert not session.solver.batch.auditor.wanted  # type: ignore[attr-defined]  # no care is taken for light that goes
    frames(session, lambda: session.run.converged or (adaptive and session.solver.issued > 20))
    few, coarse = session.lightmap.texel_count, mean_irradiance(session)
    assert picture(view, SIZE).mean() > 20  # of 255: it is lit
    material = dataclasses.replace(session.materials[1], albedo=(0.1, 0.2, 0.7))
    session.set_material(1, material)
    view.camera = dataclasses.replace(view.camera, yfov=0.5)
    view.display = view.display.replace(exposure=view.display.exposure + 0.25)
    seen, display = view.camera, view.display
    better.set()
    frames(session, lambda: session.loading is None)
    assert not session.coarse and session.message is None
    assert session.solver.batch.auditor.wanted  # type: ignore[attr-defined]
    assert session.lightmap.texel_count > 2 * few
    assert view.camera is seen and view.display == display
    assert session.materials[1] == material and session.light.adaptive == adaptive
    made = []
    for _ in range(3):
        session.poll()
        made.append(session.advance())
    assert sum(made) > 3  # fast, until it has caught up
    session.set_material_edits({})
    if not adaptive:
        frames(session, lambda: session.run.converged)
        session.restart()
        session.poll()
        assert session.advance() == 1  # no longer, also from the beginning
        frames(session, lambda: session.run.converged)
        # 10 % of light is not yet shot in either, and 200 texels follow the shadows roughly
        assert mean_irradiance(session) == pytest.approx(coarse, rel=0.1)


@pytest.mark.parametrize("adaptive", [False, True])
def test_better_texels_begin_with_the_coarse_light(
    view: View, better: threading.Event, monkeypatch: pytest.MonkeyPatch, adaptive: bool
) -> None:
    """Before any of them has got light, and when the first has, what coarse texels had is shown everywhere: until rays can be
    traced, that is."""
    session = view.session
    monkeypatch.setattr("app.solvers.shooting.ambient.tree_is_near", lambda pool: False)
    monkeypatch.setattr(loading, "default_texels", lambda sides, roots: TEXELS // (4 if adaptive else 1))
    session.light = LightmapOptions(adaptive=adaptive, depth=1)

    def shown() -> tuple[float, float]:
        """Mean, and what all but 1 % of the surfaces have at least [W/m²]."""
        light = session.lightmap.irradiance(ambient=True, whole=False).mean(-1)
        area = session.lightmap.pool.surfaces.area
        return float((light * area).sum() / area.sum()), float(np.quantile(light[area > 0], 0.01))

    session.open("cornell-box")
    frames(session, lambda: session.opened and session.solver.issued > 4)
    session.run.running = False
    session.solver.settle()  # within a batch, less has arrived than was taken from those who shoot
    coarse = shown()
    better.set()
    frames(session, lambda: session.loading is None)
    assert session.solver.issued == 0 and session.run.progress.remaining == 1.0  # the books begin anew
    mean, least = shown()
    assert mean == pytest.approx(coarse[0], rel=0.1 if adaptive else 0.05)  # texels are of other places, and there few
    assert least > 0.8 * coarse[1]
    session.work(8)
    assert session.lightmap.irradiance().max() > 0.0
    now = shown()
    assert 0.999 * mean < now[0] < 1.2 * mean and 0.999 * least < now[1], "no place is darker than it was"
    material = dataclasses.replace(session.materials[1], albedo=(0.1, 0.2, 0.7))
    session.set_material(1, material)
    assert not session.solver.batch.ambient._foreseen  # type: ignore[attr-defined]  # of walls that are others now


def test_where_better_texels_cannot_begin_with_it_they_come_all_the_same(
    gpu: Gpu,
    view: View,
    better: threading.Event,
    monkeypatch: pytest.MonkeyPatch,
    forgotten: Callable[[], list[object]],
) -> None:
    """What memory does not do for is a nicety: nothing of it stays."""
    session, make = view.session, LightTextures.make_ambient

    def full(*of: Any, of_each: bool = True) -> Any:
        if of_each:
            raise GpuError("no room")
        return make(*of, of_each=of_each)

    session.open("cornell-box")
    frames(session, lambda: session.opened and session.solver.issued > 4)
    session.run.running = False
    with monkeypatch.context() as broken:
        broken.setattr(LightTextures, "make_ambient", full)
        better.set()
        frames(session, lambda: session.loading is None)
        assert session.message is None and not forgotten()
    better.clear()
    session.atlas = session.atlas.replace(texels=TEXELS + 1)
    session.run.running = True
    session.open("cornell-box")
    frames(session, lambda: session.coarse and session.solver.issued > 4)
    session.run.running = False
    with monkeypatch.context() as broken:
        broken.setattr(carry_over, "PlaceProbe", full)
        better.set()
        frames(session, lambda: session.loading is None)
        assert session.message is None and not session.coarse and not forgotten()


def test_gathered_light_takes_the_place_of_a_picture_once_it_is_there(view: View, better: threading.Event) -> None:
    """It cannot be told what is to come: what it gives way to stays as long, neither coarse nor better texels are ever black."""
    session = view.session
    session.set_solver("gathering")
    session.open("cornell-box")
    frames(session, lambda: session.opened)
    assert session.coarse and session.lightmap.irradiance().max() > 0
    first = session.lightmap
    better.set()
    end = time.monotonic() + PATIENCE
    while session.lightmap is first:
        assert time.monotonic() < end
        session.poll()
    assert not session.coarse and session.lightmap.irradiance().max() > 0 and session.solver.issued > 0


def test_few_shots_show_most_of_a_lamp(gpu: Gpu, view: View, monkeypatch: pytest.MonkeyPatch) -> None:
    """Other light has it shoot from fifty places."""
    session, left = view.session, []
    monkeypatch.setattr(loading, "default_texels", lambda sides, roots: TEXELS)
    session.open("cornell-box")
    frames(session, lambda: session.coarse)
    for make in (session.family.for_coarse, session.family.make):
        assert make is not None
        solver = make(gpu, session.lightmap, session.options)
        solve_until(solver, 4, lambda progress: False, most=4)
        left.append(solver.settle().remaining)
        solver.release()
    assert 1 - left[0] > 1.5 * (1 - left[1])  # of a lamp of 30 texels


def test_charts_that_are_kept_need_no_coarse_light(view: View, better: threading.Event) -> None:
    session, coarse = view.session, []
    better.set()
    for _ in range(2):
        session.open("cornell-box")
        frames(session, lambda: session.loading is None or coarse.append(session.coarse) is not None)
    again = len(coarse)
    session.open("cornell-box")
    frames(session, lambda: session.loading is None or coarse.append(session.coarse) is not None)
    assert not any(coarse[again:])


def test_a_scene_without_lamps_is_shown_flat_meanwhile(view: View, better: threading.Event) -> None:
    """In coarse texels it would be black."""
    session = view.session
    dark = load_scene("cornell-box")
    materials = tuple(dataclasses.replace(material, emission=(0.0, 0.0, 0.0)) for material in dark.materials)
    session.open(dataclasses.replace(dark, materials=materials))  # type: ignore[arg-type]  # a scene that is read goes, too
    frames(session, lambda: session.loading is not None and session.loading.stage == "waiting")
    end = time.monotonic() + 0.5  # coarse texels take less
    frames(session, lambda: session.opened or time.monotonic() > end)
    assert not session.opened
    better.set()
    frames(session, lambda: session.opened)
    assert not session.coarse


@pytest.mark.parametrize("view", [1e-4], indirect=True)  # a frame may make so many shots that a tenth would be the end
def test_the_processor_is_left_to_better_charts_after_a_while(
    view: View, better: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_module, "COARSE_SECONDS", 0.0)
    monkeypatch.setattr(session_module, "COARSE_WORK", 0)
    session = view.session
    session.open("cornell-box")
    frames(session, lambda: session.coarse)
    for _ in range(5):
        session.poll()
        session.advance()
    assert session.solver.issued == 0 and not session.solving and session.run.running
    monkeypatch.setattr(session_module, "COARSE_WORK", 2)
    session.poll()
    frames(session, lambda: session.run.resting)
    assert session.solver.issued >= 2, "so much takes longer beside other programs"
    monkeypatch.setattr(session_module, "COARSE_WORK", 1 << 30)
    session.poll()
    assert not session.run.resting
    monkeypatch.setattr(session_module, "COARSE_LONGEST", session.run.seconds)
    session.poll()
    assert session.run.resting, "but no longer than this"
    monkeypatch.setattr(session_module, "COARSE_LONGEST", PATIENCE)
    remaining = 0.9 * session.run.progress.remaining
    monkeypatch.setattr(session_module, "COARSE_LEFT", remaining)
    session.poll()
    frames(session, lambda: session.run.resting)
    assert session.run.progress.remaining <= remaining and not session.solving
    better.set()
    frames(session, lambda: session.loading is None and session.run.progress.remaining < 0.3)


def test_stopped_it_stays_in_coarse_texels_and_goes_on(view: View) -> None:
    session = view.session
    session.open("cornell-box")
    frames(session, lambda: session.coarse)
    assert session.loading is not None
    session.loading.cancel()
    session.poll()
    assert session.loading is None and not session.coarse and "coarse texels" in str(session.message)
    assert session.solver.batch.auditor.wanted  # type: ignore[attr-defined]  # as much care as for any light that stays
    frames(session, lambda: session.run.converged)
    session.lightmap.refresh_ambient(wait=True)
    assert session.lightmap.texture("t_ambient").size == session.lightmap.size
