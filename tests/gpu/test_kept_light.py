"""Light that is kept goes on, in another session, to the same light as if it had never been stopped."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from solver_scenes import grey, table_room

from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.scene.lights import Light
from app.scene.model import F32, Scene
from app.scene.sky import Sky, Sun
from app.session.light_state import light_state, restore_light
from app.session.session import Session
from app.solvers import SOLVERS
from app.util.state import State
from app.util.state_file import dump_state, load_state

OTHER_DRIVERS = (
    1e-3  # of the strongest light: what they sum up in another order; the software rasteriser repeats itself
)
PIECES = 2000  # of work, at most: of pairs, whose pieces are as long as the clock says
OPEN = replace(table_room(), sky=Sky("clear", sun=Sun(135.0, 40.0)))  # has walls all around: only sums see the sky
LAMPS = (
    Light("spot", "spot", (30.0, 20.0, 10.0), (1.0, 2.5, 1.0), radius=0.1),
    Light("point", "point", (5.0, 5.0, 9.0), (3.0, 2.0, 3.0)),
)
WITHOUT_CEILING = replace(
    OPEN,
    triangles=OPEN.triangles[[k for k in range(len(OPEN.triangles)) if OPEN.object_ids[k] != 1]],
    material_ids=OPEN.material_ids[OPEN.object_ids != 1],
    object_ids=OPEN.object_ids[OPEN.object_ids != 1],
    lights=LAMPS,
)
KNOBS: dict[str, dict[str, Any]] = {
    "shooting": {"residual": 1e-6},
    "gathering": {"noise": 1e-4, "ray_memory": 1},
    "pairs": {"change": 1e-5, "senders": "all", "keep_pairs": True},
}


def opened(gpu: Gpu, scene: Scene, solver: str, *, adaptive: bool = False, texels: int = 3000) -> Session:
    session = Session(
        gpu,
        solver=solver,
        options=SOLVERS[solver].options(**KNOBS[solver]),
        atlas=AtlasOptions(texels=texels),
        light=LightmapOptions(adaptive=adaptive),
    )
    session.open_now(scene)
    return session


def work(session: Session, pieces: int) -> None:
    """As a solve without a window does, which never waits for the GPU."""
    for _ in range(pieces):
        session.run.poll(energy=False)
        session.work(1 << 30)


def kept(session: Session) -> State:
    """By way of a file."""
    file = io.BytesIO()
    dump_state(file, light_state(session))
    file.seek(0)
    return load_state(file)


def stopped_and_resumed(
    gpu: Gpu, scene: Scene, solver: str, stops: list[int], pieces: int, known: str | None = None, **how: Any
) -> F32:
    """H after so many pieces of work, with another session from each of the stops on, which has to know again all that decides
    what follows. known: an array of that which is not empty at all of the stops."""
    session, done, most = opened(gpu, scene, solver, **how), 0, 0
    for stop in stops:
        work(session, stop - done)
        session.run.poll(energy=False)
        state, done = kept(session), stop
        session.release()
        session = opened(gpu, scene, solver, **how)
        session.lightmap.refresh_ambient(wait=True)  # as in a window that has drawn: kept light knows none
        restore_light(session, state)
        again = kept(session)  # the light may be the same without some of it: it is looked at itself
        assert again.part("solver").values == state.part("solver").values
        for name, array in state.part("solver").arrays.items():
            np.testing.assert_array_equal(again.arrays[f"solver/{name}"], array, err_msg=name)
        most = max(most, 0 if known is None else len(state.arrays[known]))
    assert known is None or not stops or most > 0, "nothing was to be known at any stop"
    work(session, pieces - done)
    light = session.lightmap.irradiance()
    session.release()
    return light


def same(gpu: Gpu, one: F32, other: F32) -> bool:
    if gpu.software:
        return np.array_equal(one, other)
    return one.shape == other.shape and np.abs(one - other).max() <= OTHER_DRIVERS * np.abs(one).max()


CASES = {
    "shooting": ("shooting", table_room(), False, [3, 30], 40, "solver/batch/found/off"),
    "shooting lit by lamps and sky": ("shooting", WITHOUT_CEILING, False, [3, 30], 40, "solver/batch/found/off"),
    "shooting on quadtrees": ("shooting", table_room(), True, [8, 14, 30], 40, "solver/batch/replay/fresh"),
    "gathering": ("gathering", table_room(), False, [1, 5], 8, None),
    "gathering lit by lamps and sky": ("gathering", WITHOUT_CEILING, False, [1, 5], 8, None),
    "gathering on quadtrees": ("gathering", table_room(), True, [1, 5], 9, "solver/fresh"),
}


@pytest.mark.parametrize("name", CASES)
def test_goes_on_to_the_same_light(gpu: Gpu, name: str) -> None:
    solver, scene, adaptive, stops, pieces, known = CASES[name]
    how = {"adaptive": adaptive, "texels": 500 if adaptive else 3000, "known": known}
    at_once = stopped_and_resumed(gpu, scene, solver, [], pieces, **how)
    assert np.isfinite(at_once).all() and at_once.max() > 0
    assert same(gpu, stopped_and_resumed(gpu, scene, solver, stops, pieces, **how), at_once)


def test_pairs_go_on_within_a_bounce(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """Their pieces are as long as the clock says, so sums are rounded in another order."""
    monkeypatch.setattr("app.solvers.pairs.solver.PIECE", 0.0)
    light = []
    for stops in (0, 3):
        session = opened(gpu, table_room(), "pairs", texels=800)
        within = 0
        for piece in range(PIECES):
            if session.solver.issued == 3:
                break
            work(session, 1)
            if within < stops and piece % 4 == 1:
                state = kept(session)
                within += state.values.get("solver/bounce/at") is not None
                session.release()
                session = opened(gpu, table_room(), "pairs", texels=800)
                restore_light(session, state)
        assert session.solver.issued == 3
        assert within >= stops, "it was never stopped within a bounce"
        light.append(session.lightmap.irradiance())
        session.release()
    assert np.abs(light[0] - light[1]).max() < 1e-5 * light[0].max()


def test_the_local_matrix_begins_anew(gpu: Gpu) -> None:
    session = Session(gpu, solver="local", atlas=AtlasOptions(texels=1500))
    session.open_now(table_room())
    work(session, 3)
    restore_light(session, kept(session))
    assert session.solver.issued == 0
    assert not session.lightmap.irradiance().any()
    session.release()


def test_time_and_history_go_on(gpu: Gpu) -> None:
    session = opened(gpu, table_room(), "shooting")
    session.run.seconds = 12.5
    session.run.history.add(100, 12.5, 0.1, 0.0)
    state, rows = kept(session), session.run.history.rows
    session.release()
    session = opened(gpu, table_room(), "shooting")
    restore_light(session, state)
    assert session.run.seconds == 12.5
    assert np.array_equal(session.run.history.rows, rows)
    session.release()


def test_light_of_an_edited_scene(gpu: Gpu) -> None:
    """Another session has to be edited as this one was."""
    red = replace(table_room().materials[0], albedo=(0.8, 0.1, 0.1))
    session = opened(gpu, table_room(), "gathering")
    work(session, 3)
    session.set_material(0, red)
    work(session, 2)
    state = kept(session)
    work(session, 2)
    at_once = session.lightmap.irradiance()
    session.release()
    session = opened(gpu, table_room(), "gathering")
    with pytest.raises(UserError, match="another scene"):
        restore_light(session, state)
    session.set_material(0, red)
    restore_light(session, state)
    work(session, 2)
    assert same(gpu, session.lightmap.irradiance(), at_once)
    session.release()


def test_light_of_other_settings_is_refused(gpu: Gpu) -> None:
    session = opened(gpu, table_room(), "shooting")
    state = kept(session)
    session.release()
    session = opened(gpu, table_room(), "shooting", texels=1500)
    with pytest.raises(UserError, match=r"of --texels 3000, not 1500"):
        restore_light(session, state)
    session.release()


@pytest.fixture(scope="module")
def some_light(_gpu: Gpu) -> Iterator[tuple[Session, bytes]]:
    """A session at work, and the file of what it had at a moment."""
    session = opened(_gpu, table_room(), "shooting", adaptive=True, texels=800)
    work(session, 60)
    file = io.BytesIO()
    dump_state(file, light_state(session))
    yield session, file.getvalue()
    session.release()


def spoil_shape(state: State) -> None:
    state.arrays["lightmap/t_irradiance"] = state.arrays["lightmap/t_irradiance"][1:]


def spoil_slots(state: State) -> None:
    state.arrays["lightmap/leaves/tree/taken"] = state.arrays["lightmap/leaves/tree/taken"] + 5000


def spoil_leaves(state: State) -> None:
    state.arrays["lightmap/leaves/tree/leaves"] = state.arrays["lightmap/leaves/tree/leaves"] + np.int32(1 << 20)


def spoil_counts(state: State) -> None:
    state.values["lightmap/leaves/slots"] = 1 << 40


def spoil_values(state: State) -> None:
    state.values["solver/progress"] = "much"


def spoil_parts(state: State) -> None:
    for name in [name for name in state.arrays if name.startswith("solver/")]:
        del state.arrays[name]


@pytest.mark.parametrize(
    "spoil", [spoil_shape, spoil_slots, spoil_leaves, spoil_counts, spoil_values, spoil_parts], ids=lambda s: s.__name__
)
def test_a_damaged_state_is_one_line(gpu: Gpu, some_light: tuple[Session, bytes], spoil: Any) -> None:
    """And the session goes on from nothing."""
    session, file = some_light
    state = load_state(io.BytesIO(file))
    spoil(state)
    assert session.solver.issued > 0
    with pytest.raises(UserError, match="the light that was kept is damaged") as error:
        restore_light(session, state)
    assert "\n" not in str(error.value)
    assert session.solver.issued == 0
    work(session, 3)
    assert session.lightmap.irradiance().max() > 0


def test_a_lamp_that_is_off_is_no_part_of_it(gpu: Gpu) -> None:
    """Its shadow rays are sent anew once it shines again."""
    scene = table_room()
    session = opened(gpu, scene, "gathering")
    work(session, 3)
    session.set_material(2, grey(0.2, 0.0, double_sided=True))
    work(session, 1)
    restore_light(session, kept(session))
    session.set_material(2, scene.materials[2])
    work(session, 1)
    assert session.lightmap.irradiance().max() > 0
    session.release()
