"""What the viewer's frame asks of a session: a scene opens in parts, numbers settle, exposure is found, turns are taken."""

from __future__ import annotations

import dataclasses
import itertools
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.render.exposure import first_exposure
from app.render.options import DisplayOptions
from app.render.seen import seen_texels
from app.session.loading import load
from app.session.pacing import FAST_FRAME, SLOW_FRAME, Turns
from app.session.session import Session
from app.session.view import View
from app.solvers import ShootingOptions
from app.ui.app import Ui
from app.viewer.ui_frame import UiFrame

SMALL = AtlasOptions(texels=4000)
PATIENCE = 60.0  # s
pytestmark = pytest.mark.usefixtures("few_points")  # which a session at rest has worked out


@pytest.fixture
def view(gpu: Gpu) -> Iterator[View]:
    session = Session(gpu, atlas=SMALL, expose_on_open=True)
    view = View(session)
    yield view
    view.release()
    session.release()


@pytest.fixture
def session(view: View) -> Session:
    return view.session


def frames(session: Session, until: Callable[[], bool]) -> int:
    """Poll and advance as the window does; how many frames it took."""
    end, count = time.monotonic() + PATIENCE, 0
    while not until():
        assert time.monotonic() < end
        session.poll()
        session.advance()
        count += 1
        time.sleep(0.001)
    return count


def opened(session: Session, source: str) -> Session:
    session.open(source)
    frames(session, lambda: session.loading is None)
    return session


def test_a_scene_opens_in_parts_and_is_exposed(view: View, session: Session) -> None:
    session.open("cornell-box")
    frames(session, lambda: session.loading is not None and session.loading.ended)
    assert frames(session, lambda: session.opened) > 3, "upload and programs are spread over frames"
    assert session.solver.issued == 0 and session.stats.remaining == 1.0, "warming up leaves no light behind"
    assert session.stats.unshot == pytest.approx(session.stats.emitted)
    camera = session.scene.cameras[0]
    seen = seen_texels(session.lightmap.pool, camera.world_from_camera, camera.yfov)
    assert view.display.exposure == pytest.approx(first_exposure(session.lightmap.pool, seen))


def test_an_exposure_that_was_given_stays(gpu: Gpu) -> None:
    session = Session(gpu, atlas=SMALL)
    view = View(session, DisplayOptions(exposure=3.0))
    opened(session, "cornell-box")
    assert view.display.exposure == 3.0
    view.release()
    session.release()


def test_a_failed_load_keeps_the_scene(session: Session) -> None:
    opened(session, "furnace")
    lightmap = session.lightmap
    opened(session, "no-such-scene")
    assert session.lightmap is lightmap and session.message and "no-such-scene" in session.message


def test_another_scene_may_be_asked_for_between_two_parts(session: Session) -> None:
    opened(session, "furnace")
    session.open("cornell-box")
    frames(session, lambda: session.loading is not None and session.loading.ended)
    session.poll()
    session.poll()  # two parts of several
    assert session.loading is not None
    opened(session, "furnace")
    assert session.name != "Cornell box" and session.solver.poll(wait=True).remaining <= 1.0


@pytest.mark.parametrize("stop", ["pause", "converge"])
def test_numbers_settle_when_shooting_stops(session: Session, stop: str) -> None:
    opened(session, "cornell-box")
    frames(session, lambda: session.solver.issued >= 5)
    if stop == "pause":
        session.run.running = False
    else:
        session.set_options(session.options.replace(residual=0.99))
    assert not session.at_rest
    frames(session, lambda: session.at_rest)
    assert session.run.progress.done == session.solver.issued, "the reports of the last shots have arrived"
    stats = session.stats
    assert (
        0.9 * stats.remaining < stats.unshot / stats.emitted <= stats.remaining * (1 + 1e-6)
    )  # a report is from before its last shot
    last = [session.run.history.column(name)[-1] for name in ("work", "remaining")]
    assert last == [stats.done, pytest.approx(stats.unshot / stats.emitted)]


def test_one_shot_settles_too(session: Session) -> None:
    session.run.running = False
    opened(session, "cornell-box")
    session.work()
    frames(session, lambda: session.at_rest)
    assert session.stats.done == 1 and session.stats.unshot < session.stats.emitted


def test_a_restart_knows_its_book_without_looking(session: Session) -> None:
    opened(session, "cornell-box")
    frames(session, lambda: session.solver.issued >= 5)
    session.restart()
    kept, measured = session.run.energy, session.solver.energy()
    for field in dataclasses.fields(kept):
        np.testing.assert_allclose(getattr(kept, field.name), getattr(measured, field.name), rtol=1e-6, atol=1e-9)


def test_a_dimmed_lamp_reaches_the_book(session: Session) -> None:
    opened(session, "cornell-box")
    before = session.stats.emitted
    lamp = next(i for i, m in enumerate(session.scene.materials) if m.emits)
    material = session.scene.materials[lamp]
    session.set_material(lamp, dataclasses.replace(material, emission=tuple(e / 2 for e in material.emission)))
    frames(session, lambda: session.stats.emitted != before)
    assert session.stats.emitted == pytest.approx(before / 2, rel=1e-5)


def counted(monkeypatch: pytest.MonkeyPatch, owner: object, name: str, seconds: float = 0.0) -> list[float]:
    """When ``owner.name`` is called from now on; each call takes at least ``seconds``."""
    function, calls = getattr(owner, name), []

    def counting(*args: object) -> object:
        calls.append(time.perf_counter())
        time.sleep(seconds)
        return function(*args)

    monkeypatch.setattr(owner, name, counting)
    return calls


def dim(session: Session, factor: float) -> None:
    material = session.scene.materials[0]
    session.set_material(0, dataclasses.replace(material, albedo=tuple(factor * a for a in material.albedo)))


def test_an_edit_keeps_the_light(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    opened(session, "cornell-box")
    frames(session, lambda: session.solver.issued >= 5)
    clears = counted(monkeypatch, session.lightmap, "clear")
    light, shots = session.lightmap.irradiance(), session.solver.issued
    dim(session, 0.5)
    assert not clears and (session.lightmap.irradiance() == light).all()
    assert session.solver.issued >= shots


def test_an_edit_tells_what_it_took(session: Session) -> None:
    session.set_options(ShootingOptions(residual=0.1))
    opened(session, "cornell-box")
    assert session.stats.edit_work is None
    frames(session, lambda: session.at_rest)
    fresh = session.stats.fresh_work
    assert fresh == session.stats.done > 0
    dim(session, 0.5)
    frames(session, lambda: session.at_rest)
    assert session.stats.edit_work == session.stats.done - fresh and session.stats.fresh_work == fresh
    assert session.stats.edit_work < fresh
    session.restart()
    assert session.stats.edit_work is None and session.stats.fresh_work is None


@pytest.mark.parametrize("running", [True, False])
def test_a_slider_that_is_dragged_makes_no_book_until_it_rests(
    session: Session, monkeypatch: pytest.MonkeyPatch, running: bool
) -> None:
    opened(session, "cornell-box")
    session.run.running = running
    looks = counted(monkeypatch, session.solver, "energy")
    for _ in range(10):
        dim(session, 0.95)
        session.poll()
        session.advance()
        time.sleep(0.02)
    assert not looks
    session.solver.poll(wait=True)
    assert (session.solver.issued > 0) == running, "the light follows while it is dragged"
    frames(session, lambda: bool(looks))
    assert session.run.energy.reflectance == pytest.approx(session.solver.energy().reflectance)


def test_books_that_take_long_are_made_rarely(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    session.set_options(session.options.replace(residual=1e-9))
    opened(session, "cornell-box")
    looks = counted(monkeypatch, session.solver, "energy", seconds=0.04)
    frames(session, lambda: bool(looks))
    until = looks[0] + 2.5
    frames(session, lambda: time.perf_counter() > until)
    assert len(looks) == 1


def test_exposure_follows_the_lamp(session: Session) -> None:
    pool = load("cornell-box", SMALL).pool
    brighter = [dataclasses.replace(m, emission=tuple(8 * e for e in m.emission)) for m in pool.scene.materials]
    camera = pool.scene.cameras[0]
    seen = seen_texels(pool, camera.world_from_camera, camera.yfov)
    before = first_exposure(pool, seen)
    pool.scene = pool.scene.with_materials(tuple(brighter))
    assert first_exposure(pool, seen) == pytest.approx(before - 3)  # 2³ times the light


def test_a_frame_that_does_not_look_shows_the_view_as_it_was(view: View, gpu: Gpu, session: Session) -> None:
    session.open_now("cornell-box")
    size = (640, 360)
    texture = gpu.texture(size, 4, "f1")
    target, ui = gpu.target(texture), Ui()
    frame = UiFrame(gpu, ui)

    def seen(look: bool) -> np.ndarray:
        frame.draw(view, target, size=size, look=look)
        left, bottom, width, height = ui.view_rect
        image = np.frombuffer(texture.read(), np.uint8).reshape(size[1], size[0], 4)
        return image[bottom : bottom + height, left : left + width].copy()

    for _ in range(4):
        seen(True)  # the panels find their places
    before = seen(True)
    view.display = view.display.replace(exposure=view.display.exposure - 6)  # only the lamp is lit
    assert np.array_equal(seen(False), before)
    assert not np.array_equal(seen(True), before)
    frame.release()
    ui.release()
    gpu.release_all(target, texture)


def test_slow_frames_shoot_and_draw_in_turns() -> None:
    turns = Turns()
    assert [turns.next(0.5 * FAST_FRAME) for _ in range(3)] == [(True, True)] * 3
    slow = [turns.next(SLOW_FRAME * 1.1 if i == 0 else SLOW_FRAME * 0.55) for i in range(6)]
    assert set(slow) == {(True, False), (False, True)} and all(a != b for a, b in itertools.pairwise(slow))
    for _ in range(3):
        last = turns.next(0.4 * FAST_FRAME)
    assert last == (True, True), "and together again when they are fast"
