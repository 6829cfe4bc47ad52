"""Undo and redo over a real session: what takes a while to come back, and light that follows."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.session.edits import EditHistory
from app.session.knobs import knobs_of
from app.session.session import Session
from app.session.view import View

PATIENCE = 60.0  # s


class Edited:
    """A view of the Cornell box that is watched, frame by frame."""

    def __init__(self, gpu: Gpu) -> None:
        self.session = Session(gpu, atlas=AtlasOptions(texels=3000))
        self.view = View(self.session)
        self.history = EditHistory()
        self.session.open_now("cornell-box")
        self.frame()

    def frame(self) -> None:
        self.session.poll()
        self.history.watch(knobs_of(self.view), held=False, seconds=1.0)

    def frames_until(self, there: Callable[[], bool]) -> None:
        end = time.monotonic() + PATIENCE
        while not there():
            assert time.monotonic() < end
            self.frame()
            time.sleep(0.001)

    def undo(self) -> None:
        self.history.undo(knobs_of(self.view))
        self.frame()

    def redo(self) -> None:
        self.history.redo(knobs_of(self.view))
        self.frame()


@pytest.fixture
def edited(gpu: Gpu) -> Iterator[Edited]:
    edited = Edited(gpu)
    yield edited
    edited.view.release()
    edited.session.release()


def test_opening_and_solving_are_no_edits(edited: Edited) -> None:
    edited.session.work(4)
    edited.frame()
    assert edited.history.undoable is None


def test_a_lamp_and_its_light_come_back(edited: Edited) -> None:
    session = edited.session
    index = next(i for i, m in enumerate(session.materials) if m.emits)
    lamp = session.materials[index]
    while not session.run.converged:
        session.work(64)
        edited.frame()
    before = session.lightmap.irradiance().sum()
    session.set_material(index, dataclasses.replace(lamp, emission=(0.0, 0.0, 0.0)))
    edited.frame()
    assert edited.history.undoable == f"emission of {lamp.name}"
    edited.undo()
    assert session.materials[index] is lamp
    while not session.run.converged:
        session.work(64)
        edited.frame()
    threshold = session.options.residual
    np.testing.assert_allclose(session.lightmap.irradiance().sum(), before, rtol=5 * threshold)


def test_another_solver_is_undone(edited: Edited) -> None:
    session = edited.session
    session.set_solver("gathering")  # whose rays are waited for
    edited.frame()
    assert edited.history.undoable == "solver"
    edited.frames_until(lambda: session.solver_name == "gathering")
    session.set_options(session.options.replace(smooth=False))
    edited.frame()
    assert edited.history.undoable == "smooth"
    edited.undo()
    edited.undo()
    assert session.solver_name == "shooting" and edited.history.undoable is None
    edited.redo()
    edited.frames_until(lambda: session.solver_name == "gathering")
    edited.redo()
    assert not session.options.smooth and edited.history.redoable is None


def test_another_cut_is_undone_and_edits_before_it_stay(edited: Edited) -> None:
    session = edited.session
    white = dataclasses.replace(session.materials[0], albedo=(0.2, 0.2, 0.2))
    session.set_material(0, white)
    edited.frame()
    session.cut_anew(AtlasOptions(texels=1500), adaptive=True)
    edited.frame()
    assert edited.history.undoable == "texels"
    edited.frames_until(lambda: session.loading is None)
    assert session.light.adaptive and session.materials[0] is white and edited.history.undoable == "texels"
    edited.undo()
    edited.frames_until(lambda: session.loading is None)
    assert session.atlas == AtlasOptions(texels=3000) and not session.light.adaptive
    assert edited.history.undoable is not None and edited.history.undoable.startswith("albedo of")
    edited.undo()
    assert session.materials[0] is session.unedited.materials[0]


def test_a_cut_that_is_stopped_is_no_edit(edited: Edited) -> None:
    session = edited.session
    session.cut_anew(AtlasOptions(texels=1500))
    edited.frame()
    assert edited.history.undoable == "texels"
    assert session.loading is not None
    session.loading.cancel()
    edited.frames_until(lambda: session.loading is None)
    edited.frame()
    assert edited.history.undoable is None and session.atlas.texels == 3000
