"""Lamps are added, copied and taken away while a session is open: the light follows, and edits stay."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from solver_scenes import grey, quads_scene, room

from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.scene.area_lamps import Surfaces
from app.scene.model import Camera
from app.session.bake import take_light
from app.session.baking import Baking, Order
from app.session.session import Session
from app.session.view import TRAPPED, View
from app.ui import area_edits, edits, new_lamps
from app.ui.new_lamps import KINDS, Kind
from app.ui.state import State

PATIENCE = 60.0  # s
CAMERA = Camera("front", np.array([(1, 0, 0, 0.5), (0, 1, 0, 0.5), (0, 0, 1, 0.9), (0, 0, 0, 1.0)]), 0.7)
SURFACES = [kind for kind in KINDS if kind.surface]
OPEN = [kind for kind in KINDS if not kind.surface]


class Dark:
    """A view of a room without any lamp, and without its front wall."""

    def __init__(self, gpu: Gpu, solver: str = "gathering", *, adaptive: bool = False) -> None:
        walls = np.delete(room(), 5, axis=0)
        scene = quads_scene(walls, [grey(0.5), grey(0.2, double_sided=True)], [0, 0, 0, 0, 1])
        scene = dataclasses.replace(scene, cameras=(CAMERA,))
        light = LightmapOptions(adaptive=adaptive)
        self.session = Session(gpu, solver=solver, atlas=AtlasOptions(texels=800), light=light, expose_on_open=True)
        self.view, self.state = View(self.session), State(view_px=(0, 0, 64, 64))
        self.session.open_now(scene)

    def add(self, kind: Kind) -> None:
        kind.add(self.view, self.state)
        self.wait()

    def wait(self) -> None:
        end = time.monotonic() + PATIENCE
        while self.session.on_its_way is not None:
            assert time.monotonic() < end
            self.session.poll()
            time.sleep(0.001)
        self.session.work(32)
        self.session.run.settle()

    def release(self) -> None:
        self.view.release()
        self.session.release()


@pytest.fixture
def dark(gpu: Gpu) -> Iterator[Dark]:
    dark = Dark(gpu)
    yield dark
    dark.release()


def mean_light(dark: Dark) -> float:
    return float(dark.session.lightmap.irradiance().mean())


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.label)
@pytest.mark.parametrize("solver", ["shooting", "gathering", "local"])
def test_each_lamp_lights_a_dark_room(gpu: Gpu, solver: str, kind: Kind) -> None:
    dark = Dark(gpu, solver)
    camera, exposure = dark.view.camera.world_from_camera.copy(), dark.view.display.exposure
    assert not new_lamps.is_lit(dark.view, dark.state) and dark.session.message is None
    assert new_lamps.why_not(dark.view, kind) is None
    dark.add(kind)
    assert new_lamps.is_lit(dark.view, dark.state) and mean_light(dark) > 0
    assert (dark.view.camera.world_from_camera == camera).all(), "the eye stays"
    assert dark.view.display.exposure != exposure, "exposed for it"
    dark.release()


def test_only_a_flat_picture_is_said_to_be_shown_unlit(dark: Dark) -> None:
    display = dark.view.display
    assert "unlit" in new_lamps.dark_in_words(dark.view)
    for change in ({"grid": True}, {"layer": "irradiance"}, {"false_colour": "luminance"}):
        dark.view.display = display.replace(**change)
        assert new_lamps.dark_in_words(dark.view) == new_lamps.DARK


@pytest.mark.parametrize("kind", SURFACES, ids=lambda kind: kind.label)
def test_surfaces_come_and_go_and_edits_stay(dark: Dark, kind: Kind) -> None:
    session = dark.session
    red = dataclasses.replace(session.materials[1], albedo=(0.6, 0.1, 0.1))
    session.set_material(1, red)
    dark.add(kind)
    lamp = len(session.materials) - 1
    assert session.materials[1] is red and session.materials[lamp].emits and session.unedited is not session.read
    session.set_material(lamp, dataclasses.replace(session.materials[lamp], emission=(3.0, 2.0, 1.0)))
    area_edits.duplicate(dark.view, dark.state, lamp)
    dark.wait()
    assert [session.materials[i].emission for i in (-2, -1)] == [(3.0, 2.0, 1.0)] * 2
    session.set_material(lamp + 1, dataclasses.replace(session.materials[-1], emission=(1.0, 1.0, 1.0)))
    area_edits.remove(dark.view, lamp)
    dark.wait()
    assert len(session.materials) == lamp + 1 and session.materials[1] is red
    assert session.materials[lamp].emission == (1.0, 1.0, 1.0), "the other one stays, as it was edited"
    assert mean_light(dark) > 0


def frame(dark: Dark) -> None:
    edits.watch(dark.view, dark.state, 0.1)
    dark.session.poll()


def settle(dark: Dark) -> None:
    """Frames, as the window has them, until nothing is on its way."""
    end = time.monotonic() + PATIENCE
    while dark.session.on_its_way is not None:
        assert time.monotonic() < end
        frame(dark)
        time.sleep(0.001)
    frame(dark)


@pytest.mark.parametrize("kind", SURFACES, ids=lambda kind: kind.label)
def test_an_added_lamp_is_undone_in_one_step_and_done_again(dark: Dark, kind: Kind) -> None:
    """With the exposure that came with its light, and what was edited of it."""
    session, state = dark.session, dark.state
    red = dataclasses.replace(session.materials[1], albedo=(0.6, 0.1, 0.1))
    frame(dark)
    session.set_material(1, red)
    frame(dark)
    exposure = dark.view.display.exposure
    kind.add(dark.view, state)
    frame(dark)
    assert state.edits.undoable == "lamp added"
    settle(dark)
    lit = dark.view.display.exposure
    assert state.edits.undoable == "lamp added" and lit != exposure
    lamp = len(session.materials) - 1
    session.set_material(lamp, dataclasses.replace(session.materials[lamp], emission=(3.0, 2.0, 1.0)))
    frame(dark)
    area_edits.remove(dark.view, lamp)
    frame(dark)
    settle(dark)
    assert state.edits.undoable == "lamp removed" and not new_lamps.is_lit(dark.view, state)
    edits.undo(dark.view, state)
    state.run_actions()
    settle(dark)
    assert session.materials[lamp].emission == (3.0, 2.0, 1.0), "as it was edited"
    for _ in range(2):
        edits.undo(dark.view, state)
        state.run_actions()
        settle(dark)
    assert not new_lamps.is_lit(dark.view, state) and len(session.materials) == lamp
    assert dark.view.display.exposure == exposure and session.materials[1] is red
    assert state.edits.undoable is not None and state.edits.undoable.startswith("albedo of")
    for _ in range(2):
        edits.redo(dark.view, state)
        state.run_actions()
        settle(dark)
    assert session.materials[lamp].emission == (3.0, 2.0, 1.0) and new_lamps.is_lit(dark.view, state)
    assert dark.view.display.exposure == lit


def test_a_texel_density_is_an_edit(dark: Dark) -> None:
    """It is undone and done again; edits of the material and the eye stay; light begins again."""
    session, state = dark.session, dark.state
    dark.add(SURFACES[0])
    frame(dark)
    came, density = session.unedited.materials[1], session.charts.density
    session.set_material(1, dataclasses.replace(came, albedo=(0.6, 0.1, 0.1)))
    frame(dark)
    finer = session.asked_surfaces.with_scale((came.name, 1), 2.0, 1.0)

    def texels() -> int:
        pool = session.lightmap.pool
        face = pool.surfaces.face[pool.surfaces.face >= 0]
        return int((session.unedited.material_ids[session.charts.face_triangle[face]] == 1).sum())

    before, eye = texels(), dark.view.camera.world_from_camera.copy()
    session.change_surfaces(finer)
    frame(dark)
    settle(dark)
    assert texels() > 2 * before and session.materials[1].lightmap_scale == 2.0
    assert session.materials[1].albedo == (0.6, 0.1, 0.1) and (dark.view.camera.world_from_camera == eye).all()
    assert session.charts.density < density, "a number of texels was asked for"
    taken = take_light(session)
    assert [m.lightmap_scale for m in (taken.unedited.materials[1], taken.scene.materials[1])] == [1.0, 2.0], (
        "so written"
    )
    assert state.edits.undoable == f"texel density of {came.name}"
    edits.undo(dark.view, state)
    state.run_actions()
    settle(dark)
    assert texels() == before and session.materials[1].albedo == (0.6, 0.1, 0.1)
    edits.redo(dark.view, state)
    state.run_actions()
    settle(dark)
    assert texels() > 2 * before and session.materials[1].albedo == (0.6, 0.1, 0.1)
    assert state.edits.redoable is None


def test_a_lamp_that_was_removed_again_comes_back(dark: Dark) -> None:
    """Adding and removing it are two steps, in a scene that shines without it, too."""
    dark.add(SURFACES[0])
    frame(dark)
    SURFACES[1].add(dark.view, dark.state)
    frame(dark)
    settle(dark)
    added = dark.session.surfaces
    area_edits.remove(dark.view, len(dark.session.materials) - 1)
    frame(dark)
    settle(dark)
    assert len(dark.session.surfaces.lamps) == 1
    edits.undo(dark.view, dark.state)
    dark.state.run_actions()
    settle(dark)
    assert dark.session.surfaces == added


def test_a_lamp_that_was_stopped_on_its_way_is_no_edit(dark: Dark) -> None:
    frame(dark)
    SURFACES[0].add(dark.view, dark.state)
    frame(dark)
    assert dark.state.edits.undoable == "lamp added" and dark.session.loading is not None
    dark.session.loading.cancel()
    settle(dark)
    frame(dark)
    assert dark.state.edits.undoable is None and dark.session.surfaces == Surfaces()


def test_an_added_lamp_stays_however_the_scene_is_cut(dark: Dark) -> None:
    """Also where both are asked for at once."""
    session = dark.session
    SURFACES[0].add(dark.view, dark.state)
    session.cut_anew(AtlasOptions(texels=1600))
    dark.wait()
    assert session.atlas.texels == 1600 and new_lamps.is_lit(dark.view, dark.state)
    session.cut_anew(AtlasOptions(texels=800))
    dark.wait()
    assert new_lamps.is_lit(dark.view, dark.state) and len(session.surfaces.lamps) == 1


def test_surfaces_stay_while_they_are_baked(dark: Dark, tmp_path: Path) -> None:
    session = dark.session
    dark.add(SURFACES[0])
    assert session.loading is None
    baking = Baking(session, Order(tmp_path / "out"))
    assert new_lamps.why_not(dark.view, SURFACES[0]) == session.fixed is not None
    with pytest.raises(UserError, match="stop the bake first"):
        session.change_surfaces(Surfaces())
    baking.poll()
    assert baking.active and session.loading is None
    baking.stop()
    assert new_lamps.why_not(dark.view, SURFACES[0]) is None
    baking.release()


def test_a_lamp_is_not_added_while_another_comes(dark: Dark) -> None:
    SURFACES[0].add(dark.view, dark.state)
    assert new_lamps.why_not(dark.view, SURFACES[1]) == area_edits.LOADING
    assert new_lamps.why_not(dark.view, OPEN[0]) is None
    OPEN[0].add(dark.view, dark.state)
    dark.wait()
    assert len(dark.session.edited_scene.lights) == 1 and dark.session.materials[-1].emits, "both are there"


def test_sides_that_faced_nothing_are_lit_by_a_sky(dark: Dark) -> None:
    """The back of a wall that is seen from both sides: light reaches it only from beyond all surfaces."""
    session = dark.session
    assert session.charts.dark_faces > 0
    texels, edited = session.lightmap.texel_count, session.edited
    dark.add(next(kind for kind in KINDS if kind.label == "Sky"))
    assert session.charts.dark_faces == 0 and session.lightmap.texel_count > texels
    assert session.edited is edited, "it can be undone"
    session.set_sky(None)
    dark.wait()
    assert not new_lamps.is_lit(dark.view, dark.state)


@pytest.mark.parametrize(("solver", "adaptive"), [("shooting", True), ("pairs", False), ("gathering", True)])
def test_what_is_offered_is_taken(gpu: Gpu, solver: str, adaptive: bool) -> None:
    dark = Dark(gpu, solver, adaptive=adaptive)
    for kind in OPEN:
        assert new_lamps.why_not(dark.view, kind) is None
        dark.add(kind)
    dark.release()


def test_trapped_light_is_said_no_longer_when_it_is_not(dark: Dark) -> None:
    dark.session.message = TRAPPED
    dark.view.look_for_light()
    assert dark.session.message is None
