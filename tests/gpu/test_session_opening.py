"""A session opens scenes in the background, or cuts them anew: what is kept, stopped or refused meanwhile."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from furnace_session import ATLAS, SHOOTING, irradiance, session, view, wait_for
from gl_objects import forgotten, held

from app.atlas.options import AtlasOptions
from app.errors import SceneError, UserError
from app.gpu import Gpu
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View

__all__ = ["forgotten", "session", "view"]


def test_a_scene_opens_in_the_background(session: Session) -> None:
    session.solve(Stop(work=8))
    session.open("cornell-box")
    assert session.name == "Furnace"  # until it is there
    wait_for(session)
    assert session.name == "Cornell box" and session.message is None
    assert session.solver.issued == 0
    assert session.advance() == 0  # this frame has done enough
    session.poll()
    assert session.advance() == 1
    assert set(session.load_seconds) >= {"read", "unfold", "texels", "upload"}


def test_another_density_cuts_the_scene_anew(session: Session) -> None:
    before = session.lightmap.texel_count
    session.cut_anew(AtlasOptions(texels=4 * before))
    wait_for(session)
    assert session.name == "Furnace"
    assert session.lightmap.texel_count == pytest.approx(4 * before, rel=0.3)  # whole patches only


def test_cutting_anew_keeps_edits_exposure_and_camera(view: View, session: Session) -> None:
    """Nothing is read again: what was edited before and while it is cut stays, and so does what the user has set."""
    session.expose_on_open = True
    before = session.lightmap
    green = dataclasses.replace(session.scene.materials[0], albedo=(0.1, 0.7, 0.2))
    session.set_material(0, green)
    view.display = view.display.replace(exposure=-3.5)
    view.camera.orbit(0.7, 0.2)
    eye = view.camera.eye.copy()
    session.cut_anew(AtlasOptions(texels=4000))
    dimmed = dataclasses.replace(green, emission=(0.5, 0.25, 0.125))
    session.set_material(0, dimmed)  # while it is under way
    wait_for(session)
    assert session.lightmap is not before and session.atlas.texels == 4000
    assert session.scene.materials[0] is dimmed
    np.testing.assert_array_equal(session.lightmap.irradiance(), 0)
    residual = session.lightmap.residual()[session.lightmap.pool.surfaces.face >= 0]
    np.testing.assert_allclose(residual, np.broadcast_to(np.pi * np.array(dimmed.emission), residual.shape), rtol=1e-6)
    assert session.stats.emitted == pytest.approx(session.stats.unshot, rel=1e-5)  # a sum in single precision
    assert view.display.exposure == -3.5
    np.testing.assert_array_equal(view.camera.eye, eye)


def test_a_scene_on_its_way_is_not_lost_to_another_cut(session: Session) -> None:
    session.open("cornell-box")
    with pytest.raises(UserError, match="cornell-box is loading"):
        session.cut_anew(AtlasOptions(texels=2000))
    wait_for(session)
    assert session.name == "Cornell box" and session.atlas == ATLAS


def test_a_cut_that_is_stopped_changes_nothing(session: Session) -> None:
    before = session.lightmap
    session.cut_anew(AtlasOptions(texels=4000))
    assert session.loading is not None
    session.loading.cancel()
    session.poll()
    assert session.loading is None and session.lightmap is before and session.atlas == ATLAS
    assert session.parameters["atlas"] == ATLAS.as_dict()
    assert session.message == "Furnace: stopped; Furnace stays as it is"


@pytest.mark.parametrize("parts", range(1, 4))
def test_what_is_stopped_while_it_is_uploaded_keeps_the_scene(
    session: Session, forgotten: Callable[[], list[object]], parts: int
) -> None:
    session.solve(Stop(work=8))
    light = irradiance(session)
    session.open("cornell-box")
    assert session.loading is not None
    until = time.monotonic() + 60
    while not session.loading.ended:
        assert time.monotonic() < until
        time.sleep(0.001)
    before = held(session.gpu)
    for _ in range(parts):
        session.poll()
    assert held(session.gpu) > before
    session.loading.cancel()
    session.poll()
    assert session.loading is None and session.name == "Furnace" and irradiance(session) == light
    assert session.message == "cornell-box: stopped; Furnace stays as it is"
    assert not forgotten()
    session.work()
    assert irradiance(session) > light


def test_options_changed_while_a_scene_is_uploaded_are_used(session: Session) -> None:
    session.open("cornell-box")
    until = time.monotonic() + 60
    while session.loading is not None and not session.loading.ended:
        assert time.monotonic() < until
        time.sleep(0.001)
    session.poll()
    session.set_options(session.options.replace(level=4))
    wait_for(session)
    assert session.name == "Cornell box"
    assert session.solver.options == session.options and session.options.level == 4


@pytest.mark.parametrize("cut", [False, True], ids=["another scene", "cut anew"])
@pytest.mark.parametrize("change", [{"storage": "rgba16f"}, {"gradient": 0.1, "depth": 2}], ids=str)
def test_how_light_is_held_is_as_asked_for_while_a_scene_loads(
    session: Session, change: dict[str, object], cut: bool
) -> None:
    if cut:
        session.cut_anew(AtlasOptions(texels=2000), adaptive=True)
    else:
        session.open("cornell-box")
    session.set_light(session.light.replace(**change))
    wait_for(session)
    held = session.light.as_dict()
    assert held["adaptive"] is cut and {name: held[name] for name in change} == change
    assert session.lightmap.options == session.light and session.lightmap.storage == session.light.storage
    session.work(8)
    assert irradiance(session) > 0


def test_quadtrees_are_asked_for_before_or_after_a_scene_loads(gpu: Gpu) -> None:
    session = Session(gpu, options=SHOOTING, atlas=ATLAS)
    session.open("furnace")
    with pytest.raises(UserError, match="furnace is loading"):
        session.set_light(session.light.replace(adaptive=True))
    wait_for(session)
    assert not session.light.adaptive and not session.lightmap.pool.adaptive
    session.set_light(session.light.replace(adaptive=True))
    wait_for(session)
    assert session.light.adaptive and session.lightmap.pool.adaptive
    session.release()


def test_a_bad_file_leaves_the_scene_and_says_why(session: Session, tmp_path: Path) -> None:
    session.solve(Stop(work=8))
    before = irradiance(session)
    bad = tmp_path / "bad.glb"
    bad.write_bytes(b"not a scene")
    session.open(bad)
    wait_for(session)
    assert session.message is not None and "bad.glb" in session.message
    assert session.name == "Furnace" and irradiance(session) == before
    with pytest.raises(SceneError, match=r"bad\.glb"):
        session.open_now(bad)
    assert session.name == "Furnace" and irradiance(session) == before
    session.open_now("furnace")
    assert session.message is None


def test_a_session_without_a_scene(gpu: Gpu, tmp_path: Path) -> None:
    session = Session(gpu, atlas=ATLAS)
    assert not session.opened and session.name == ""
    assert session.advance() == 0
    with pytest.raises(UserError):
        session.open_now(tmp_path / "nowhere.glb")
    session.poll()
    session.release()
