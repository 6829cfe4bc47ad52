"""Views whose sessions are kept: saved, opened again, and put aside."""

from __future__ import annotations

import dataclasses
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.scene.library import scene_path
from app.scene.lights import Light
from app.session.keeping import Keeping
from app.session.session import Session
from app.session.view import View
from app.ui import settings as ui_settings
from app.ui.state import State

PATIENCE = 60.0  # s


class Place:
    """A view with its keeping, and frames."""

    def __init__(self, gpu: Gpu, folder: Path | None = None) -> None:
        self.session = Session(gpu, atlas=AtlasOptions(texels=2000))
        self.view = View(self.session)
        self.state = State()
        self.state.keeping = self.keeping = Keeping(folder, ui_settings.KNOWN)
        self.notes: list[str] = []

    def frame(self) -> None:
        self.session.poll()
        self.notes += self.keeping.poll(self.view, self.tables, lambda s: ui_settings.put(self.view, self.state, s))

    def tables(self) -> dict:
        return ui_settings.tables(self.view, self.state)

    def frames_until(self, there: Callable[[], bool]) -> None:
        end = time.monotonic() + PATIENCE
        while not there():
            assert time.monotonic() < end, self.session.message
            self.frame()
            time.sleep(0.001)

    def open(self, path: Path | str) -> Place:
        if Path(path).suffix == ".glow":
            self.keeping.open(self.view, Path(path))
        else:
            self.session.open(path)
        self.frames_until(lambda: self.session.on_its_way is None)
        self.frame()
        return self

    def save(self, path: Path) -> Path:
        self.keeping.save(self.view, path, self.tables())
        return self.keeping.path

    def release(self) -> None:
        self.view.release()
        self.session.release()


@pytest.fixture
def place(gpu: Gpu) -> Iterator[Callable[..., Place]]:
    made: list[Place] = []

    def make(folder: Path | None = None) -> Place:
        made.append(Place(gpu, folder))
        return made[-1]

    yield make
    for one in made:
        one.release()


def edit(place: Place) -> None:
    """Something of each kind."""
    session, view = place.session, place.view
    session.set_material(1, dataclasses.replace(session.materials[1], albedo=(0.1, 0.2, 0.3)))
    session.set_lights((Light("bulb", intensity=(1.0, 0.5, 0.25), position=(0.1, 0.2, 0.3)),))
    session.set_options(session.options.replace(residual=0.05))
    place.state.pace = place.state.pace.replace(pace="fast")
    view.display = view.display.replace(exposure=1.5)
    view.camera.orbit(0.3, 0.1)
    view.bookmarks[4] = view.camera.copy()
    view.camera.dolly(0.5)


def copied(folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    return Path(shutil.copy(scene_path("cornell-box"), folder / "room.toml"))


def emitters(place: Place) -> list[int]:
    return [index for index in np.unique(place.session.scene.material_ids) if place.session.materials[index].emits]


def settle(place: Place) -> None:
    place.frames_until(lambda: place.session.on_its_way is None)
