"""Coarse light: where charts take a while, a scene is lit in coarse texels until they are there, and then in those."""

from __future__ import annotations

import dataclasses
import itertools
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gl_objects import forgotten, held

from app.atlas import charts_cache
from app.atlas.options import AtlasOptions
from app.errors import GpuError, UserError
from app.gpu import Gpu
from app.lightmap import carry_over
from app.lightmap.options import LightmapOptions
from app.lightmap.textures import LightTextures
from app.render import resolve
from app.scene.load import load_scene
from app.scene.sky import Sky
from app.session import loading, opening
from app.session import session as session_module
from app.session.pacing import SLOW_FRAME, Turns
from app.session.session import Session
from app.session.view import View
from app.solvers import SOLVERS, ShootingOptions
from app.solvers.run import solve_until
from app.solvers.shooting.solver import Shooting
from app.ui.app import Ui
from app.util import cache
from app.viewer.picture import picture
from app.viewer.ui_frame import UiFrame

__all__ = ["forgotten"]

SIZE = (96, 96)
TEXELS = 3000
PATIENCE = 60.0  # s


@pytest.fixture
def better(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[threading.Event]:
    """Better charts wait for this, but for a second at most once the test is over; coarse ones are made for any scene."""
    go_on, made = threading.Event(), charts_cache._made

    def waiting(scene: Any, atlas: Any, roots: Any, progress: Any, *more: Any) -> Any:
        while not go_on.wait(0.01):
            progress("waiting", 0.1)
        return made(scene, atlas, roots, progress, *more)

    monkeypatch.setattr(charts_cache, "_made", waiting)
    monkeypatch.setattr(charts_cache, "FEWEST", 0)
    monkeypatch.setattr(loading, "COARSE_FROM", 0)
    monkeypatch.setattr(session_module, "COARSE_SECONDS", PATIENCE)
    monkeypatch.setattr(session_module, "COARSE_LONGEST", PATIENCE)
    monkeypatch.setattr(session_module, "COARSE_LEFT", 0.0)
    monkeypatch.setattr(loading, "default_texels", lambda sides, roots: TEXELS // 16)
    with cache.elsewhere(tmp_path):
        yield go_on
        go_on.set()


@pytest.fixture
def view(gpu: Gpu, better: threading.Event, request: pytest.FixtureRequest) -> Iterator[View]:
    """Light is there with a tenth unshot, or as much as a test says."""
    options = ShootingOptions(resolution=64, residual=getattr(request, "param", 0.1))
    session = Session(gpu, options=options, atlas=AtlasOptions(texels=TEXELS), expose_on_open=True)
    view = View(session)
    yield view
    view.release()
    session.release()


def frames(session: Session, until: Callable[[], bool]) -> None:
    """Poll and advance as the window does."""
    end = time.monotonic() + PATIENCE
    while not until():
        assert time.monotonic() < end
        session.poll()
        session.advance()


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


def test_coarse_texels_that_do_not_fit_leave_it_to_better_ones(
    view: View, better: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither where they cannot be made, nor uploaded, nor where the solver chosen meanwhile cannot be had."""
    session, tried = view.session, []

    def fail(*args: Any, **more: Any) -> Any:
        tried.append(args)
        raise UserError("no room")

    with monkeypatch.context() as broken:
        broken.setattr(loading, "coarse_charts", fail)
        session.open("furnace")
        frames(session, lambda: bool(tried))
        better.set()
        frames(session, lambda: session.loading is None)
    assert session.name == "Furnace" and session.message is None
    better.clear()
    with monkeypatch.context() as broken:
        broken.setattr(opening, "Lightmap", fail)
        session.open("cornell-box")
        frames(session, lambda: len(tried) == 2)
        assert session.loading is not None and session.name == "Furnace"
    better.set()
    frames(session, lambda: session.loading is None)
    assert session.name == "Cornell box" and session.message is None


def test_edits_stay_where_the_chosen_solver_cannot_be_had(
    view: View, better: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = view.session

    def fail(name: str) -> None:
        raise UserError("no room")

    with monkeypatch.context() as broken:
        broken.setattr(session, "set_solver", fail)
        session.open("cornell-box")
        frames(session, lambda: session.opened)
        assert session.coarse and session.message == "no room"
    material = dataclasses.replace(session.materials[1], albedo=(0.1, 0.2, 0.7))
    session.set_material(1, material)
    better.set()
    frames(session, lambda: session.loading is None)
    assert session.materials[1] == material and session.message is None


def test_a_sky_over_coarse_texels_has_dark_sides_cut(view: View, better: threading.Event) -> None:
    session, read = view.session, load_scene("cornell-box")
    materials = tuple(dataclasses.replace(material, double_sided=True) for material in read.materials)
    session.open(dataclasses.replace(read, materials=materials))  # type: ignore[arg-type]  # a scene that is read goes, too
    frames(session, lambda: session.coarse)
    dark, sky = session.charts.dark_faces, Sky("uniform")
    session.set_sky(sky)
    assert dark > 0 and not session.coarse and session.loading is not None
    better.set()
    frames(session, lambda: session.loading is None)
    assert session.charts.dark_faces < dark and session.scene.sky is sky


def test_another_scene_may_be_opened_meanwhile(view: View, better: threading.Event) -> None:
    session = view.session
    session.open("cornell-box")
    frames(session, lambda: session.coarse)
    session.open("furnace")
    assert not session.coarse
    better.set()
    frames(session, lambda: session.loading is None)
    assert session.name == "Furnace"


def test_programs_draw_once_before_light_needs_them(
    gpu: Gpu, view: View, better: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of coarse light are fewer; another scene may need more, and reloaded ones have not drawn."""
    session, warmed, warm_up = view.session, [], Shooting.warm_up

    def counted(solver: Shooting) -> Iterator[None]:
        warmed.append(solver)
        return warm_up(solver)

    def warmed_for(name: str) -> int:
        """How often, where it opens in coarse texels first, then in better ones."""
        better.clear()
        warmed.clear()
        session.atlas = session.atlas.replace(texels=session.atlas.texels + 1)  # or its charts are kept
        session.open(name)
        frames(session, lambda: session.coarse)
        better.set()
        frames(session, lambda: session.loading is None)
        return len(warmed)

    monkeypatch.setattr(Shooting, "warm_up", counted)
    assert [warmed_for("furnace") for _ in range(2)] == [1, 0]
    monkeypatch.setattr(gpu.shaders, "generation", gpu.shaders.generation + 1)  # as a reload does
    assert warmed_for("furnace") == 1
    more = gpu.shaders.compiled  # a name that no program has had

    def needy(*args: Any, **options: Any) -> Shooting:
        gpu.shaders.program("imgui/present", slots={f"of {more}": "nothing"})
        return Shooting(*args, **options)

    monkeypatch.setitem(SOLVERS, "shooting", dataclasses.replace(session.family, for_coarse=needy))
    assert warmed_for("furnace") == 1


def test_programs_that_only_are_to_be_compiled_draw_next_to_nothing(gpu: Gpu) -> None:
    """And light is then as without."""
    session = Session(gpu, atlas=AtlasOptions(texels=2000))
    session.open_now("furnace")
    session.work(4)
    light = session.lightmap.irradiance()
    session.solver.reset()
    for _ in session.solver.warm_up():
        pass
    assert (session.lightmap.irradiance() != 0).any(-1).sum() <= 1 < (light != 0).any(-1).sum()
    session.solver.reset()
    session.restart()
    session.work(4)
    np.testing.assert_array_equal(session.lightmap.irradiance(), light)
    session.release()


def test_nothing_stays_on_the_gpu(
    gpu: Gpu, view: View, better: threading.Event, forgotten: Callable[[], list[object]]
) -> None:
    """From one opening to the next; with the first, programs have drawn all that they will."""
    session, counts = view.session, []
    for texels in (TEXELS, TEXELS + 1, TEXELS + 2):
        better.clear()
        session.atlas = AtlasOptions(texels=texels)
        session.open("furnace")
        frames(session, lambda: session.coarse and session.solver.issued > 0)
        better.set()
        frames(session, lambda: session.loading is None and session.solver.issued > 0)
        session.run.settle()
        counts.append(held(gpu))
    assert counts[1:] == counts[:1] * 2 and not forgotten()


@pytest.fixture
def seen(gpu: Gpu, view: View) -> Iterator[Callable[..., np.ndarray]]:
    """Draws a frame as the window does, ``look``: with the view anew; gives the view's lower half, below what says how far
    loading is."""
    size = 640, 360
    texture = gpu.texture(size, 4, "f1")
    target, ui = gpu.target(texture), Ui(live=False)
    frame = UiFrame(gpu, ui, whole=False)

    def seen(*, look: bool = True) -> np.ndarray:
        frame.draw(view, target, size=size, look=look)
        left, bottom, width, height = ui.view_rect
        image = np.frombuffer(texture.read(), np.uint8).reshape(size[1], size[0], 4)
        return image[bottom : bottom + height // 2, left : left + width].copy()

    yield seen
    frame.release()
    ui.release()
    gpu.release_all(target, texture)


def test_a_picture_at_rest_shows_all_of_the_coarse_light(
    view: View, seen: Callable[..., np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where a frame brings only a few of its texels up to date."""
    session = view.session
    monkeypatch.setattr(session_module, "COARSE_LEFT", 0.5)
    session.open("cornell-box")
    frames(session, lambda: session.opened)
    for _ in range(4):
        seen()  # the panels find their places
    monkeypatch.setattr(resolve, "TEXELS_PER_FRAME", 1)
    frames(session, lambda: session.run.resting)
    at_rest = [seen() for _ in range(2)][-1]
    monkeypatch.setattr(resolve, "TEXELS_PER_FRAME", 1 << 20)
    view.display = view.display.replace(exposure=view.display.exposure + 1)
    seen()
    view.display = view.display.replace(exposure=view.display.exposure - 1)
    all_of_it = seen()
    assert session.coarse and all_of_it.std() > 10
    assert np.array_equal(at_rest, all_of_it)


def test_coarse_light_is_seen_where_solving_and_drawing_take_turns(
    view: View, seen: Callable[..., np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Frames that solve do not draw, and so the next one must; where the camera moved in one, too."""
    session, turns, pictures = view.session, Turns(), []
    session.open("cornell-box")
    frames(session, lambda: session.opened)
    for _ in range(4):
        seen()  # the panels find their places
    for _ in range(6):
        solve, look = turns.next(1.1 * SLOW_FRAME)
        if solve:
            session.work()
        pictures.append((solve, look, seen(look=look)))
    anew = [not np.array_equal(one[-1], other[-1]) for one, other in itertools.pairwise(pictures)]
    looked = [look for _, look, _ in pictures[1:]]
    assert session.coarse and anew == looked and set(looked) == {False, True}
    monkeypatch.setattr(session_module, "COARSE_LEFT", 1.0)
    session.poll()
    frames(session, lambda: session.run.resting)
    before = seen()
    view.camera = dataclasses.replace(view.camera, yfov=0.5)
    assert np.array_equal(seen(look=False), before)
    assert not np.array_equal(seen(), before)
